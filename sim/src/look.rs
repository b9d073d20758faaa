//! The values that the simulated world shows, by name: those of the control protocol's `state`, and further names under
//! which scenario files know some of them. Looking at them takes no time and changes nothing.
//!
//! `rotor` is a value of axis 0, `rotor 2` and `axes.2.rotor` are that of axis 2; what a board has several of is
//! numbered, as in `outputs.1`. All values are numbers: true is 1, false is 0.

use hal_sim::board::{Board, BoardKind};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::fault::CanState;
use hal_sim::world::pin::Pin;

use crate::suggest::suggestion;

/// A value that can be looked at on boards of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    value: &'static Value,
    /// The axis, or the number within a list; 0 for other values of the board.
    number: usize,
}

/// A row of the table of values.
#[derive(Debug)]
struct Value {
    name: &'static str,
    unit: &'static str,
    of: Of,
}

/// The part that a value belongs to, and how it is read.
#[derive(Clone, Copy, Debug)]
enum Of {
    /// The board.
    Board(fn(&Board) -> f64),
    /// A member of a list on the board, and how many a board of a kind has.
    List(fn(&BoardKind) -> usize, fn(&Board, usize) -> f64),
    /// An axis.
    Axis(fn(&Board, usize) -> f64),
}

const FLAG: &str = "0 or 1";
const POSITION: &str = "1/256 full steps";

/// All values. Names with a dot stand inside an object or a list of `state`.
static VALUES: &[Value] = &[
    Value { name: "time", unit: "ms", of: Of::Board(|board| (board.now() / MILLISECOND) as f64) },
    Value { name: "time_us", unit: "us", of: Of::Board(|board| (board.now() / MICROSECOND) as f64) },
    Value { name: "power", unit: FLAG, of: Of::Board(|board| flag(board.is_powered())) },
    Value {
        name: "rotor",
        unit: POSITION,
        of: Of::Axis(|board, axis| board.world().axis(axis).motor().rotor() as f64),
    },
    Value {
        name: "field",
        unit: POSITION,
        of: Of::Axis(|board, axis| board.world().axis(axis).motor().field() as f64),
    },
    Value {
        name: "lost_steps",
        unit: "full steps",
        of: Of::Axis(|board, axis| board.world().axis(axis).motor().lost_steps() as f64),
    },
    Value { name: "position", unit: "microsteps", of: Of::Axis(|board, axis| board.observe(axis).position.into()) },
    Value { name: "velocity", unit: "internal units", of: Of::Axis(|board, axis| board.observe(axis).velocity.into()) },
    Value {
        name: "current",
        unit: "1/32 of full scale",
        of: Of::Axis(|board, axis| board.observe(axis).current.into()),
    },
    Value { name: "bridges_on", unit: FLAG, of: Of::Axis(|board, axis| flag(board.observe(axis).bridges_on)) },
    Value { name: "stall_guard", unit: "0..1023", of: Of::Axis(|board, axis| board.observe(axis).stall_guard.into()) },
    Value {
        name: "load",
        unit: "0..1, of the torque at full current",
        of: Of::Axis(|board, axis| board.world().axis(axis).motor().load_told()),
    },
    Value { name: "switches.left", unit: FLAG, of: Of::Axis(|board, axis| level(board, axis, Pin::Left)) },
    Value { name: "switches.right", unit: FLAG, of: Of::Axis(|board, axis| level(board, axis, Pin::Right)) },
    Value { name: "switches.home", unit: FLAG, of: Of::Axis(|board, axis| level(board, axis, Pin::Home)) },
    Value {
        name: "encoder",
        unit: "0..1023",
        of: Of::Axis(|board, axis| board.axis_inputs(axis).encoder.unwrap_or_default().into()),
    },
    Value { name: "abn", unit: "counts", of: Of::Axis(|board, axis| board.axis_inputs(axis).abn.count as f64) },
    Value {
        name: "inputs",
        unit: FLAG,
        of: Of::List(|kind| kind.inputs.len(), |board, number| bit(board.world().inputs(), number)),
    },
    Value {
        name: "enable",
        unit: FLAG,
        of: Of::Board(|board| board.kind().enable_input.map_or(0.0, |number| bit(board.world().inputs(), number))),
    },
    Value { name: "analog", unit: "0..4095", of: Of::Board(|board| reading(board, 0)) },
    Value { name: "analogs", unit: "0..4095", of: Of::List(|kind| kind.analog().count(), reading) },
    Value {
        name: "outputs",
        unit: FLAG,
        of: Of::List(|kind| kind.outputs as usize, |board, number| bit(board.world().outputs().digital, number)),
    },
    Value { name: "pull_ups", unit: FLAG, of: Of::Board(|board| bit(board.world().outputs().pull_ups, 0)) },
    Value {
        name: "pull_up_groups",
        unit: FLAG,
        of: Of::List(|kind| kind.pull_ups as usize, |board, number| bit(board.world().outputs().pull_ups, number)),
    },
    Value {
        name: "leds",
        unit: FLAG,
        of: Of::List(|_| 2, |board, number| flag(board.world().outputs().leds.get(number) == Some(&true))),
    },
    Value {
        name: "can",
        unit: "2 on, 1 passive, 0 off",
        of: Of::Board(|board| match board.can() {
            CanState::On => 2.0,
            CanState::Passive => 1.0,
            CanState::Off => 0.0,
        }),
    },
    Value { name: "supply", unit: "V", of: Of::Board(|board| f64::from(board.world().supply()) / 10.0) },
    Value { name: "temperature", unit: "degrees Celsius", of: Of::Board(|board| board.world().temperature().into()) },
];

/// Further names, and those in the table that they stand for.
static ALIASES: [(&str, &str); 8] = [
    ("bridges", "bridges_on"),
    ("left_switch", "switches.left"),
    ("right_switch", "switches.right"),
    ("home_switch", "switches.home"),
    ("output_0", "outputs.0"),
    ("output_1", "outputs.1"),
    ("led_1", "leds.0"),
    ("led_2", "leds.1"),
];

impl Look {
    /// The value of a name, with the number of its axis behind it where it is not axis 0: `supply`, `rotor`, `rotor 2`.
    ///
    /// # Errors
    /// There is no such value on a board of this kind; the message says what to write instead.
    pub fn parse(text: &str, kind: &BoardKind) -> Result<Self, String> {
        match text.split_whitespace().collect::<Vec<_>>().as_slice() {
            [name] => Self::named(name, None, kind),
            [name, axis] => {
                let number = axis.parse().map_err(|_| format!("axis '{axis}' is not a number"))?;
                Self::named(name, Some(number), kind)
            }
            _ => Err("a value has a name, and the number of an axis may follow, as in: rotor 2".into()),
        }
    }

    /// The value of a name, of this axis, or of axis 0 if it is `None`.
    ///
    /// # Errors
    /// As for [`Look::parse`].
    pub fn named(name: &str, axis: Option<usize>, kind: &BoardKind) -> Result<Self, String> {
        let canonical = ALIASES.iter().find(|(alias, _)| *alias == name).map_or(name, |(_, canonical)| canonical);
        let (canonical, axis) = match in_axes(canonical) {
            Some((number, field)) if axis.is_none() => (field, Some(number)),
            _ => (canonical, axis),
        };
        let found = |name: &str| VALUES.iter().find(|value| value.name == name);
        let numbered =
            canonical.rsplit_once('.').and_then(|(list, number)| Some((list, number.parse::<usize>().ok()?)));
        let (value, index) = match (found(canonical), numbered) {
            (Some(value), _) => (value, None),
            (None, Some((list, number))) => (found(list).ok_or_else(|| unknown(name, kind))?, Some(number)),
            (None, None) => return Err(unknown(name, kind)),
        };
        let number = match (value.of, index, axis) {
            (Of::Axis(_), None, axis) => {
                let axis = axis.unwrap_or_default();
                kind.check_axis(axis)?;
                axis
            }
            (Of::Board(_) | Of::List(..), _, Some(axis)) => {
                return Err(format!("'{name}' is a value of the whole board: leave out the axis {axis}"));
            }
            (Of::Board(_), None, None) if value.name == "enable" && kind.enable_input.is_none() => {
                return Err(format!("the {} has no ENABLE input", kind.name));
            }
            (Of::Board(_), None, None) => 0,
            (Of::List(count, _), Some(number), None) if number < count(kind) => number,
            (Of::List(count, _), _, None) => return Err(out_of_list(value.name, count(kind), kind)),
            (Of::Board(_) | Of::Axis(_), Some(_), _) => return Err(unknown(name, kind)),
        };
        Ok(Look { value, number })
    }

    /// The value now.
    pub fn read(&self, board: &Board) -> f64 {
        match self.value.of {
            Of::Board(read) => read(board),
            Of::List(_, read) | Of::Axis(read) => read(board, self.number),
        }
    }

    /// The value's name, with the number of its axis if that is not 0; [`Look::parse`] reads it.
    pub fn name(&self) -> String {
        match (self.value.of, self.number) {
            (Of::List(..), number) => format!("{}.{number}", self.value.name),
            (Of::Board(_), _) | (Of::Axis(_), 0) => self.value.name.into(),
            (Of::Axis(_), axis) => format!("{} {axis}", self.value.name),
        }
    }

    /// The unit of the value, or what its numbers mean.
    pub fn unit(&self) -> &'static str {
        self.value.unit
    }

    /// All values of a board, those of axis 0 for all axes.
    pub fn all(kind: &BoardKind) -> impl Iterator<Item = Self> {
        VALUES.iter().flat_map(|value| {
            let count = match value.of {
                Of::List(count, _) => count(kind),
                Of::Board(_) if value.name == "enable" => usize::from(kind.enable_input.is_some()),
                Of::Board(_) | Of::Axis(_) => 1,
            };
            (0..count).map(move |number| Look { value, number })
        })
    }
}

/// Axis and field of `axes.2.rotor`.
fn in_axes(name: &str) -> Option<(usize, &str)> {
    let (axis, field) = name.strip_prefix("axes.")?.split_once('.')?;
    Some((axis.parse().ok()?, field))
}

fn out_of_list(name: &str, count: usize, kind: &BoardKind) -> String {
    match count.checked_sub(1) {
        Some(last) => format!("the {} has {name}.0 to {name}.{last}", kind.name),
        None => format!("the {} has no {name}", kind.name),
    }
}

fn unknown(name: &str, kind: &BoardKind) -> String {
    let values: Vec<String> = Look::all(kind).map(|look| look.name()).collect();
    let known = values.iter().map(String::as_str).chain(ALIASES.iter().map(|(alias, _)| *alias));
    let suggestion = suggestion(name, known);
    if suggestion.is_empty() {
        let aliases = ALIASES.map(|(alias, _)| alias).join(", ");
        format!("unknown value '{name}'; the world has: {}; and by other names {aliases}", values.join(", "))
    } else {
        format!("unknown value '{name}'{suggestion}")
    }
}

fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

fn bit(word: u32, number: usize) -> f64 {
    flag(word >> number & 1 != 0)
}

fn level(board: &Board, axis: usize, pin: Pin) -> f64 {
    flag(board.world().axis(axis).level(pin))
}

fn reading(board: &Board, number: usize) -> f64 {
    board.world().analog().get(number).copied().unwrap_or_default().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::board::{TMCM_1140, TMCM_3212, TMCM_6110};
    use hal_sim::control::{Line, State};
    use hal_sim::world::config::WorldConfig;
    use serde_json::Value as Json;

    /// All numbers in a JSON value, with their paths.
    fn numbers(path: &str, json: &Json, found: &mut Vec<(String, f64)>) {
        let below =
            |key: &dyn std::fmt::Display| if path.is_empty() { key.to_string() } else { format!("{path}.{key}") };
        match json {
            Json::Object(fields) => fields.iter().for_each(|(key, json)| numbers(&below(key), json, found)),
            Json::Array(items) => items.iter().enumerate().for_each(|(key, json)| numbers(&below(&key), json, found)),
            Json::Bool(on) => found.push((path.into(), flag(*on))),
            Json::Number(number) => found.push((path.into(), number.as_f64().unwrap())),
            Json::String(word) => {
                let state = ["off", "passive", "on"].iter().position(|name| name == word).unwrap();
                found.push((path.into(), state as f64));
            }
            Json::Null => panic!("{path} is null"),
        }
    }

    #[test]
    fn every_field_of_the_state_has_a_name_and_the_same_value() {
        for kind in [&TMCM_1140, &TMCM_6110, &TMCM_3212] {
            let mut board = Board::of_kind(kind, &WorldConfig::default(), 1);
            for line in
                ["input 0 1", "analog 0 1234", "supply 12.5", "temperature 41", "can passive", "slip 5", "load 0.25"]
            {
                Line::parse(line).unwrap().control.apply(&mut board).unwrap();
            }
            if kind.axes() > 1 {
                Line::parse("slip -7 2").unwrap().control.apply(&mut board).unwrap();
                Line::parse("press home 1").unwrap().control.apply(&mut board).unwrap();
            }
            board.advance_to(12_345_678);
            let mut fields = Vec::new();
            numbers("", &serde_json::to_value(State::of(&board)).unwrap(), &mut fields);
            let mut named = Vec::new();
            for (path, value) in &fields {
                let look = Look::parse(path, kind).unwrap_or_else(|error| panic!("{}: {path}: {error}", kind.name));
                assert_eq!(look.read(&board), *value, "{}: {path}", kind.name);
                named.push(look.name());
            }
            assert!(fields.iter().filter(|(_, value)| *value != 0.0).count() > 8, "the board shows hardly anything");
            // Only the time in milliseconds is not in the state.
            let others: Vec<String> =
                Look::all(kind).map(|look| look.name()).filter(|name| !named.contains(name)).collect();
            assert_eq!(others, ["time"]);
        }
    }

    #[test]
    fn further_names_stand_for_values_of_the_table() {
        for (alias, name) in ALIASES {
            assert_eq!(Look::parse(alias, &TMCM_1140).unwrap().name(), *name);
        }
        assert_eq!(Look::parse("axes.2.rotor", &TMCM_6110).unwrap().name(), "rotor 2");
        assert_eq!(Look::parse("left_switch 1", &TMCM_6110).unwrap().name(), "switches.left 1");
        assert_eq!(Look::parse("rotor 0", &TMCM_1140).unwrap().name(), "rotor");
    }

    #[test]
    fn mistakes_say_what_to_write() {
        for (text, expected) in [
            ("roter", "unknown value 'roter'; did you mean 'rotor'?"),
            ("left_swich", "did you mean 'left_switch'?"),
            ("zzz", "unknown value 'zzz'; the world has: time, time_us, power, rotor"),
            ("rotor 1", "no axis 1: the TMCM-1140 has one, axis 0"),
            ("rotor x", "axis 'x' is not a number"),
            ("rotor 1 2", "as in: rotor 2"),
            ("supply 0", "'supply' is a value of the whole board: leave out the axis 0"),
            ("outputs.2", "the TMCM-1140 has outputs.0 to outputs.1"),
            ("outputs", "the TMCM-1140 has outputs.0 to outputs.1"),
            ("enable", "the TMCM-1140 has no ENABLE input"),
            ("rotor.1", "unknown value 'rotor.1'; the world has: time"),
        ] {
            let error = Look::parse(text, &TMCM_1140).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
        assert_eq!(Look::parse("pull_up_groups.0", &TMCM_3212).unwrap_err(), "the TMCM-3212 has no pull_up_groups");
    }
}
