//! The built-in include files: names for the numbers of parameters and interrupts, made from the product's tables.

use std::fmt::{Debug, Write};

use tmcm::module::Spec;
use tmcm::param::{ALL_INTERRUPTS, AxisParameter, INTERRUPTS as NUMBERS, Row};

use super::source::Source;

/// Built-in file with the numbers of axis and global parameters.
pub const PARAMETERS: &str = "TMCLParam.tmc";
/// Built-in file with the numbers of interrupts, which their parameters in bank 3 share.
pub const INTERRUPTS: &str = "Interrupts.inc";

/// Names that existing programs use but that [`short`] would not make.
const KNOWN: &[(AxisParameter, &str)] = &[(AxisParameter::MaximumSpeed, "APMaxPositioningSpeed")];

/// A constant of a built-in file, with a remark for its comment.
pub(super) struct Constant {
    pub(super) name: String,
    pub(super) number: u8,
    pub(super) note: String,
    pub(super) subject: Subject,
}

/// The kind of number that a built-in constant has.
#[derive(Clone, Copy, Debug)]
pub(super) enum Subject {
    /// The number of an axis parameter.
    Axis(&'static Row),
    /// The number of a global parameter in bank 0.
    Global(&'static Row),
    /// The number of an axis.
    Motor,
    /// The number of an interrupt, with its parameter in bank 3 if it has one.
    Interrupt(Option<&'static Row>),
}

impl Constant {
    fn new(name: impl Into<String>, number: u8, note: impl Into<String>, subject: Subject) -> Self {
        Constant { name: name.into(), number, note: note.into(), subject }
    }

    fn of_row(name: impl Into<String>, row: &'static Row, subject: fn(&'static Row) -> Subject) -> Self {
        Constant::new(name, row.number, row.name, subject(row))
    }
}

/// The constants of all built-in files, each with the name of its file.
pub(super) fn constants(spec: &Spec) -> impl Iterator<Item = (&'static str, Constant)> {
    let with = |file: &'static str| move |constant| (file, constant);
    parameters(spec).into_iter().map(with(PARAMETERS)).chain(interrupts(spec).into_iter().map(with(INTERRUPTS)))
}

/// The text of a built-in file for a product; `None` if no built-in file has this name. Upper and lower case are the
/// same.
pub fn text(spec: &Spec, name: &str) -> Option<String> {
    let (title, constants) = if name.eq_ignore_ascii_case(PARAMETERS) {
        ("Axis parameters (AP) and global parameters (GP).", parameters(spec))
    } else if name.eq_ignore_ascii_case(INTERRUPTS) {
        (
            "Interrupts; those that are configured have their parameter in bank 3 under the same number.",
            interrupts(spec),
        )
    } else {
        return None;
    };
    let mut text = format!("// {title}\n");
    for Constant { name, number, note, .. } in &constants {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name} = {number} // {note}");
    }
    Some(text)
}

/// True for the name of a built-in file. Upper and lower case are the same.
pub(super) fn is_built_in(name: &str) -> bool {
    canonical(name).is_some()
}

/// The name of the built-in file that is meant. Upper and lower case are the same.
pub(super) fn canonical(name: &str) -> Option<&'static str> {
    [PARAMETERS, INTERRUPTS].into_iter().find(|file| name.eq_ignore_ascii_case(file))
}

/// The built-in file with this name as a source. Upper and lower case are the same.
pub(super) fn source(spec: &Spec, name: &str) -> Option<Source> {
    let canonical = canonical(name)?;
    let source = Source::from_text(&format!("{canonical} (built in)"), &text(spec, canonical)?);
    Some(Source { built_in: true, ..source })
}

/// Name of the built-in file that defines a constant.
pub(super) fn file_with(spec: &Spec, name: &str) -> Option<&'static str> {
    constants(spec).find(|(_, constant)| constant.name.eq_ignore_ascii_case(name)).map(|(file, _)| file)
}

fn parameters(spec: &Spec) -> Vec<Constant> {
    let axis = spec.axis.rows.iter().map(|parameter| {
        let known = KNOWN.iter().find(|(known, _)| *known == parameter.function).map(|(_, name)| (*name).to_string());
        Constant::of_row(known.unwrap_or_else(|| short("AP", &parameter.function)), &parameter.row, Subject::Axis)
    });
    let global = spec
        .global
        .rows
        .iter()
        .map(|found| Constant::of_row(short("GP", &found.function), &found.row, Subject::Global));
    let motors =
        (0..spec.axes).map(|axis| Constant::new(format!("Motor{axis}"), axis, format!("axis {axis}"), Subject::Motor));
    axis.chain(global).chain(motors).collect()
}

fn interrupts(spec: &Spec) -> Vec<Constant> {
    let each = NUMBERS.iter().flat_map(|numbered| {
        (0..numbered.per.count(spec.axes, spec.inputs)).map(move |index| {
            let name = format!("TI_{}{index}", numbered.name.to_uppercase().replace(' ', "_"));
            let parameter = numbered.parameter_name(index).map(|name| name.to_string());
            let note = parameter.unwrap_or_else(|| format!("{}, axis {index}", numbered.name));
            Constant::new(name, numbered.number(index), note, Subject::Interrupt(numbered.row.as_ref()))
        })
    });
    let global = Constant::new("TI_GLOBAL", ALL_INTERRUPTS, "all interrupts together", Subject::Interrupt(None));
    let mut all: Vec<Constant> = each.chain([global]).collect();
    all.sort_by_key(|constant| constant.number);
    all
}

/// The name of a parameter's constant: the prefix and the parameter's function, shortened as in `APMaxAcceleration`.
fn short(prefix: &str, parameter: &impl Debug) -> String {
    format!("{prefix}{parameter:?}").replace("Maximum", "Max").replace("Minimum", "Min")
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use tmcm::param::Interrupt;
    use tmcm::product::{TMCM_1140, TMCM_3110, TMCM_6110};

    use super::*;

    /// Existing programs contain these names, so none of them may change.
    #[test]
    fn names_that_programs_use() {
        let lines = |file| text(&TMCM_1140, file).unwrap();
        for name in ["APMaxPositioningSpeed = 4 ", "APMaxAcceleration = 5 ", "Motor0 = 0 ", "GPAutoStart = 77 "] {
            assert!(lines("tmclparam.TMC").contains(&format!("\n{name}")), "{name}");
        }
        for name in [
            "TI_TIMER0 = 0 ",
            "TI_POSITION_REACHED0 = 3 ",
            "TI_STALLGUARD0 = 15 ",
            "TI_DEVIATION0 = 21 ",
            "TI_STOP_LEFT0 = 27 ",
            "TI_GLOBAL = 255 ",
        ] {
            assert!(lines("Interrupts.inc").contains(&format!("\n{name}")), "{name}");
        }
        assert_eq!(text(&TMCM_1140, "Other.inc"), None);
        assert_eq!(file_with(&TMCM_1140, "ti_global"), Some("Interrupts.inc"));
    }

    #[test]
    fn every_parameter_has_a_name_of_its_own() {
        for (spec, count) in [(&TMCM_1140, 12), (&TMCM_3110, 3 + 5 * 3 + 8), (&TMCM_6110, 3 + 5 * 6 + 8)] {
            let (parameters, interrupts) = (parameters(spec), interrupts(spec));
            let all: Vec<String> = parameters.iter().chain(&interrupts).map(|c| c.name.to_lowercase()).collect();
            assert_eq!(parameters.len(), spec.axis.rows.len() + spec.global.rows.len() + usize::from(spec.axes));
            assert_eq!(interrupts.len(), count + 1);
            let exists = |n| n == ALL_INTERRUPTS || Interrupt::find(n, spec.axes, spec.inputs).is_some();
            assert!(interrupts.iter().all(|constant| exists(constant.number)));
            assert_eq!(all.iter().collect::<HashSet<_>>().len(), all.len());
        }
    }

    #[test]
    fn names_of_several_axes() {
        let parameters = text(&TMCM_6110, PARAMETERS).unwrap();
        for name in ["Motor5 = 5 ", "APGroupIndex = 213 "] {
            assert!(parameters.contains(&format!("\n{name}")), "{name}");
        }
        assert!(!parameters.contains("\nMotor6 "));
        let interrupts = text(&TMCM_6110, INTERRUPTS).unwrap();
        for name in ["TI_POSITION_REACHED5 = 8 ", "TI_STALLGUARD5 = 20 ", "TI_STOP_RIGHT5 = 38 ", "TI_INPUT7 = 46 "] {
            assert!(interrupts.contains(&format!("\n{name}")), "{name}");
        }
    }
}
