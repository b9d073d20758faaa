//! What is sampled of an axis, and samples as numbers.

use tmcm::param::AxisParameter;

use crate::conversation::{Conversation, Error};

/// The parameters that are sampled, each with its name in the headline of the CSV form.
const COLUMNS: [(AxisParameter, &str); 8] = [
    (AxisParameter::ActualPosition, "position"),
    (AxisParameter::ActualSpeed, "speed"),
    (AxisParameter::ActualLoad, "load"),
    (AxisParameter::DriverErrorFlags, "driver_flags"),
    (AxisParameter::ExtendedErrorFlags, "extended_flags"),
    (AxisParameter::LeftSwitch, "left_switch"),
    (AxisParameter::RightSwitch, "right_switch"),
    (AxisParameter::HomeSwitch, "home_switch"),
];

/// The values of all columns; `None` for a parameter that the module does not have.
pub(super) type Sample = [Option<i32>; COLUMNS.len()];

/// Samples an axis.
pub(super) fn sample(module: &mut Conversation, axis: u8) -> Result<Sample, Error> {
    let mut sample = Sample::default();
    for (value, (parameter, _)) in sample.iter_mut().zip(COLUMNS) {
        *value = match module.axis(axis, parameter) {
            Ok(value) => Some(value),
            Err(error) if error.is_refusal() => None,
            Err(error) => return Err(error),
        };
    }
    Ok(sample)
}

/// The headline of the CSV form. A single axis has no number in it.
pub(super) fn headline(axes: &[u8]) -> String {
    let mut columns = vec!["time_s".to_owned()];
    for axis in axes {
        columns.extend(COLUMNS.map(|(_, name)| match axes {
            [_] => name.into(),
            _ => format!("{name}_{axis}"),
        }));
    }
    columns.join(",")
}

/// The values of a sample with commas in between.
pub(super) fn numbers(sample: &Sample) -> String {
    sample.map(|value| value.map_or_else(String::new, |value| value.to_string())).join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_several_axes_have_their_numbers() {
        let one = "time_s,position,speed,load,driver_flags,extended_flags,left_switch,right_switch,home_switch";
        assert_eq!(headline(&[4]), one);
        let two = headline(&[0, 4]);
        assert!(
            two.starts_with("time_s,position_0,speed_0,") && two.ends_with("right_switch_4,home_switch_4"),
            "{two}"
        );
        assert_eq!(two.split(',').count(), 1 + 2 * COLUMNS.len());
        assert_eq!(numbers(&[Some(-5), None, Some(0), Some(1), None, None, None, Some(2)]), "-5,,0,1,,,,2");
    }
}
