//! The include files that are part of the program: names for the numbers in the parameter tables.

use std::fmt::{Debug, Write};
use std::sync::LazyLock;

use tmcm::module::TMCM_1140_AXES as AXES;
use tmcm::param::{AxisParameter, GlobalParameter, InterruptParameter, Row};
use tmcm::vm::Interrupts;

use super::source::Source;

/// Axis and global parameters.
pub const PARAMETERS: &str = "TMCLParam.tmc";
/// Interrupts, and with the same numbers their parameters in bank 3.
pub const INTERRUPTS: &str = "Interrupts.inc";

/// Names that programs use already and that are not made by rule.
const KNOWN: &[(AxisParameter, &str)] = &[(AxisParameter::MaximumSpeed, "APMaxPositioningSpeed")];

/// A name, its number and what it is.
struct Constant {
    name: String,
    number: u8,
    note: String,
}

impl Constant {
    fn new(name: impl Into<String>, number: u8, note: impl Into<String>) -> Self {
        Constant { name: name.into(), number, note: note.into() }
    }

    fn of_row(name: impl Into<String>, row: &Row) -> Self {
        Constant::new(name, row.number, row.name)
    }
}

/// The text of a built-in file, by its name in any case.
pub fn text(name: &str) -> Option<String> {
    let (title, constants) = if name.eq_ignore_ascii_case(PARAMETERS) {
        ("Axis parameters (AP) and global parameters (GP).", &PARAMETER_NAMES)
    } else if name.eq_ignore_ascii_case(INTERRUPTS) {
        (
            "Interrupts; those that are configured have their parameter in bank 3 under the same number.",
            &INTERRUPT_NAMES,
        )
    } else {
        return None;
    };
    let mut text = format!("// {title}\n");
    for Constant { name, number, note } in constants.iter() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name} = {number} // {note}");
    }
    Some(text)
}

/// A built-in file, by its name in any case.
pub(super) fn source(name: &str) -> Option<Source> {
    let canonical = [PARAMETERS, INTERRUPTS].into_iter().find(|file| name.eq_ignore_ascii_case(file))?;
    let source = Source::from_text(&format!("{canonical} (built in)"), &text(canonical)?);
    Some(Source { built_in: true, ..source })
}

/// The built-in file that defines a name.
pub(super) fn file_with(name: &str) -> Option<&'static str> {
    let defines = |constants: &[Constant]| constants.iter().any(|c| c.name.eq_ignore_ascii_case(name));
    if defines(&PARAMETER_NAMES) { Some(PARAMETERS) } else { defines(&INTERRUPT_NAMES).then_some(INTERRUPTS) }
}

static PARAMETER_NAMES: LazyLock<Vec<Constant>> = LazyLock::new(parameters);
static INTERRUPT_NAMES: LazyLock<Vec<Constant>> = LazyLock::new(interrupts);

fn parameters() -> Vec<Constant> {
    let axis = AxisParameter::ALL.iter().map(|parameter| {
        let known = KNOWN.iter().find(|(known, _)| known == parameter).map(|(_, name)| (*name).to_string());
        Constant::of_row(known.unwrap_or_else(|| short("AP", parameter)), parameter.row())
    });
    let global = GlobalParameter::ALL.iter().map(|parameter| Constant::of_row(short("GP", parameter), parameter.row()));
    let motors = (0..AXES as u8).map(|axis| Constant::new(format!("Motor{axis}"), axis, format!("axis {axis}")));
    axis.chain(global).chain(motors).collect()
}

fn interrupts() -> Vec<Constant> {
    let configured = InterruptParameter::ALL.iter().map(|parameter| {
        let mut name = String::from("TI");
        for letter in format!("{parameter:?}").chars() {
            if letter.is_uppercase() {
                name.push('_');
            }
            name.push(letter.to_ascii_uppercase());
        }
        Constant::of_row(name, parameter.row())
    });
    let events = (0..AXES as u8).flat_map(|axis| {
        Interrupts::EVENTS.map(|(first, event)| {
            let name = format!("TI_{}{axis}", event.to_uppercase().replace(' ', "_"));
            Constant::new(name, first + axis, format!("{event}, axis {axis}"))
        })
    });
    let global = Constant::new("TI_GLOBAL", Interrupts::GLOBAL, "all interrupts together");
    let mut all: Vec<Constant> = configured.chain(events).chain([global]).collect();
    all.sort_by_key(|constant| constant.number);
    all
}

/// The name by rule: the prefix and the parameter's name in the table, shortened as in `APMaxAcceleration`.
fn short(prefix: &str, parameter: &impl Debug) -> String {
    format!("{prefix}{parameter:?}").replace("Maximum", "Max").replace("Minimum", "Min")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Programs in the field contain these; none may change.
    #[test]
    fn names_that_programs_use() {
        let lines = |file| text(file).unwrap();
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
        assert_eq!(text("Other.inc"), None);
        assert_eq!(file_with("ti_global"), Some("Interrupts.inc"));
    }

    #[test]
    fn every_parameter_has_a_name_of_its_own() {
        let all: Vec<String> = parameters().into_iter().chain(interrupts()).map(|c| c.name.to_lowercase()).collect();
        assert_eq!(parameters().len(), AxisParameter::COUNT + GlobalParameter::COUNT + AXES);
        assert_eq!(interrupts().len(), InterruptParameter::COUNT + AXES * Interrupts::EVENTS.len() + 1);
        let exists = |number| number == Interrupts::GLOBAL || Interrupts::exists(number, AXES);
        assert!(interrupts().iter().all(|constant| exists(constant.number)));
        assert_eq!(all.iter().collect::<HashSet<_>>().len(), all.len());
    }
}
