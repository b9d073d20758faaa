//! Watches of the clients of the control port: values of a module, told as virtual time passes.

use hal_sim::clock::{MICROSECOND, Nanos};
use serde::ser::{Serialize, SerializeMap, Serializer};
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::protocol::{Quantity, Seen, TIME};

/// Values that are told at each interval of virtual time.
#[derive(Debug)]
pub struct Watch {
    /// Index of the module.
    module: usize,
    values: Vec<Quantity>,
    every: Nanos,
    /// When the watch began.
    begun: Nanos,
    /// When the next line is due.
    due: Nanos,
    /// Lines since the last one that was written, for which there was no room.
    missed: u64,
    /// A step waits for its client to read.
    awaited: bool,
}

impl Watch {
    /// Values of the module with this index, from `now` on: the first line is due one interval later.
    pub fn new(module: usize, every: Nanos, values: Vec<Quantity>, now: Nanos) -> Self {
        Watch { module, values, every, begun: now, due: now + every, missed: 0, awaited: true }
    }

    /// When the watch began.
    pub fn begun(&self) -> Nanos {
        self.begun
    }

    /// When the next line is due.
    pub fn due(&self) -> Nanos {
        self.due
    }

    /// The line that is due, without its end: one object of JSON with the number of lines that are missing before it,
    /// the time, and the values. A value that cannot be told at this moment is null.
    pub fn take(&mut self, fleet: &mut Fleet<impl VirtualModule>) -> String {
        let mut fields = Vec::with_capacity(self.values.len() + 2);
        if self.missed > 0 {
            fields.push(("missed", Field::Whole(self.missed as i64)));
        }
        fields.push((TIME, Field::Whole((self.due / MICROSECOND) as i64)));
        if let Some(module) = fleet.modules_mut().get_mut(self.module) {
            let mut seen = Seen(module);
            for value in &self.values {
                fields.push((value.name(), value.read(&mut seen).map_or(Field::Null, Field::of)));
            }
        }
        let line = line(&fields);
        self.missed = 0;
        self.due += self.every;
        line
    }

    /// True while a step waits for the client to read: until a line has been left out, or [`Watch::forgo`].
    pub fn is_awaited(&self) -> bool {
        self.awaited
    }

    /// Steps wait for the client no more, because it does not read.
    pub fn forgo(&mut self) {
        self.awaited = false;
    }

    /// Leaves out the line that is due.
    pub fn miss(&mut self) {
        self.missed += 1;
        self.awaited = false;
        self.due += self.every;
    }

    /// The last line, of a watch that has ended for this reason.
    pub fn ended(why: &'static str) -> String {
        line(&[("ended", Field::Word(why))])
    }
}

/// A value as it is written in JSON.
#[derive(Debug)]
enum Field {
    /// A whole number, without a point.
    Whole(i64),
    Number(f64),
    Word(&'static str),
    Null,
}

impl Field {
    fn of(value: f64) -> Self {
        let whole = value as i64;
        if whole as f64 == value { Field::Whole(whole) } else { Field::Number(value) }
    }
}

impl Serialize for Field {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Field::Whole(number) => serializer.serialize_i64(*number),
            Field::Number(number) => serializer.serialize_f64(*number),
            Field::Word(word) => serializer.serialize_str(word),
            Field::Null => serializer.serialize_unit(),
        }
    }
}

/// Fields in their order.
struct Line<'a>(&'a [(&'a str, Field)]);

impl Serialize for Line<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        self.0.iter().try_for_each(|(name, field)| map.serialize_entry(name, field))?;
        map.end()
    }
}

fn line(fields: &[(&str, Field)]) -> String {
    // Numbers, names and nothing else: that can always be written.
    serde_json::to_string(&Line(fields)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::board::TMCM_1140;
    use hal_sim::clock::MILLISECOND;
    use hal_sim::world::config::WorldConfig;
    use tmcm_sim::protocol::Request;

    #[test]
    fn lines_are_told_in_the_order_of_the_names_and_count_what_is_missing() {
        let mut fleet = Fleet::new(&WorldConfig::default(), &[None], 1);
        let request = Request::parse("watch 10 ms supply rotor GAP 4, 0", &[&TMCM_1140]).unwrap();
        let Request::Watch { module, every, values } = request else { panic!("no watch") };
        let mut watch = Watch::new(module, every, values, 3 * MILLISECOND);
        assert_eq!((watch.begun(), watch.due()), (3 * MILLISECOND, 13 * MILLISECOND));
        assert_eq!(watch.take(&mut fleet), r#"{"time_us":13000,"supply":24,"rotor":0,"GAP 4, 0":1000}"#);
        watch.miss();
        watch.miss();
        let next = watch.take(&mut fleet);
        assert!(next.starts_with(r#"{"missed":2,"time_us":43000,"#), "{next}");
        assert!(watch.take(&mut fleet).starts_with(r#"{"time_us":53000,"#));
        assert_eq!(Watch::ended("restart"), r#"{"ended":"restart"}"#);
        assert_eq!(line(&[("a", Field::of(12.5)), ("b", Field::Null)]), r#"{"a":12.5,"b":null}"#);
    }
}
