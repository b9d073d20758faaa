//! Samples of the axes, each with the time at which it was taken.

use std::time::Duration;

use serde::{Serialize, Serializer, ser::SerializeMap};
use tmcm::tmcl::{Command, Opcode};

use super::column::Column;
use crate::conversation::{Conversation, Error};

/// A sample of an axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sample {
    /// When the first of its values was read, on the clock of the link.
    pub at: Duration,
    /// The value of each column; `None` for a parameter that the module does not have.
    pub values: Vec<Option<i32>>,
}

/// Samples these axes, column by column: so what is read of all axes first, their positions, is read at about the same
/// time.
pub fn sample(module: &mut Conversation, axes: &[u8], columns: &[Column]) -> Result<Vec<Sample>, Error> {
    let mut samples = vec![Sample { at: Duration::ZERO, values: Vec::with_capacity(columns.len()) }; axes.len()];
    for (place, column) in columns.iter().enumerate() {
        for (sample, axis) in samples.iter_mut().zip(axes) {
            let before = module.time();
            let value = match module.value(Command::new(Opcode::Gap as u8, column.number, *axis, 0)) {
                Ok(value) => Some(value),
                Err(error) if error.is_refusal() => None,
                Err(error) => return Err(error),
            };
            if place == 0 {
                // The module has read it about half-way between request and reply.
                sample.at = before + module.time().saturating_sub(before) / 2;
            }
            sample.values.push(value);
        }
    }
    Ok(samples)
}

/// The headline of the CSV form. A single axis has no number in it.
pub fn headline(axes: &[u8], columns: &[Column]) -> String {
    let mut names = vec!["time_s".to_owned()];
    for axis in axes {
        names.extend(columns.iter().map(|Column { name, .. }| match axes {
            [_] => name.clone(),
            _ => format!("{name}_{axis}"),
        }));
    }
    names.join(",")
}

/// A row of the CSV form: the time since `begun` at which the first axis was read, and the values of all axes.
pub fn row(samples: &[Sample], begun: Duration) -> String {
    let at = samples.first().map_or(Duration::ZERO, |sample| sample.at.saturating_sub(begun));
    let values = samples.iter().flat_map(|sample| &sample.values);
    let values = values.map(|value| value.map_or_else(String::new, |value| format!("{value}")));
    std::iter::once(format!("{:.3}", at.as_secs_f64())).chain(values).collect::<Vec<_>>().join(",")
}

/// A sample as an object of JSON. Values that the module does not have are left out.
pub struct Object<'a> {
    /// The axis that was sampled.
    pub axis: u8,
    /// The columns that were sampled.
    pub columns: &'a [Column],
    /// The values.
    pub sample: &'a Sample,
    /// When it was begun, on the clock of the link.
    pub begun: Duration,
}

impl Serialize for Object<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        let milliseconds = self.sample.at.saturating_sub(self.begun).as_secs_f64() * 1000.0;
        map.serialize_entry("time_s", &(milliseconds.round() / 1000.0))?;
        map.serialize_entry("axis", &self.axis)?;
        for (Column { name, .. }, value) in self.columns.iter().zip(&self.sample.values) {
            if let Some(value) = value {
                map.serialize_entry(name, value)?;
            }
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::usual;
    use super::*;

    #[test]
    fn columns_of_several_axes_have_their_numbers() {
        let one = "time_s,position,speed,load,driver_flags,extended_flags,left_switch,right_switch,home_switch";
        assert_eq!(headline(&[4], &usual()), one);
        let two = headline(&[0, 4], &usual());
        assert!(
            two.starts_with("time_s,position_0,speed_0,") && two.ends_with("right_switch_4,home_switch_4"),
            "{two}"
        );
        assert_eq!(two.split(',').count(), 1 + 2 * usual().len());
    }

    #[test]
    fn a_row_has_the_time_of_its_first_axis() {
        let sample = |at, values| Sample { at: Duration::from_millis(at), values };
        let samples = [sample(1_250, vec![Some(-5), None]), sample(1_260, vec![Some(0), Some(7)])];
        let begun = Duration::from_secs(1);
        assert_eq!(row(&samples, begun), "0.250,-5,,0,7");
        let columns = &usual()[..2];
        let object = |sample| serde_json::to_string(&Object { axis: 3, columns, sample, begun }).unwrap();
        assert_eq!(object(&samples[0]), r#"{"time_s":0.25,"axis":3,"position":-5}"#);
        assert_eq!(object(&samples[1]), r#"{"time_s":0.26,"axis":3,"position":0,"speed":7}"#);
    }
}
