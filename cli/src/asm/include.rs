//! The include files that are part of the program: names for the numbers in the parameter tables.

use std::fmt::{Debug, Write};
use std::sync::LazyLock;

use tmcm::param::{AxisParameter, GlobalParameter, InterruptParameter, Row};

use super::source::Source;

/// Axis and global parameters.
pub const PARAMETERS: &str = "TMCLParam.tmc";
/// Interrupts, and with the same numbers their parameters in bank 3.
pub const INTERRUPTS: &str = "Interrupts.inc";

/// Names that programs use already and that are not made by rule.
const KNOWN: &[(AxisParameter, &str)] = &[(AxisParameter::MaximumSpeed, "APMaxPositioningSpeed")];

/// The interrupts without a parameter (manual section 3.6.6.1).
const WITHOUT_PARAMETER: &[(&str, u8, &str)] = &[
    ("TI_POSITION_REACHED0", 3, "target position reached"),
    ("TI_STALLGUARD0", 15, "stallGuard"),
    ("TI_DEVIATION0", 21, "deviation"),
    ("TI_GLOBAL", 255, "all interrupts together"),
];

/// A name, its number and what it is.
struct Constant {
    name: String,
    number: u8,
    note: &'static str,
}

impl Constant {
    fn new(name: String, row: &'static Row) -> Self {
        Constant { name, number: row.number, note: row.name }
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

/// True when the module has an interrupt with this number.
pub(super) fn is_interrupt(number: u8) -> bool {
    InterruptParameter::from_number(number).is_some() || WITHOUT_PARAMETER.iter().any(|(_, n, _)| *n == number)
}

static PARAMETER_NAMES: LazyLock<Vec<Constant>> = LazyLock::new(parameters);
static INTERRUPT_NAMES: LazyLock<Vec<Constant>> = LazyLock::new(interrupts);

fn parameters() -> Vec<Constant> {
    let axis = AxisParameter::ALL.iter().map(|parameter| {
        let known = KNOWN.iter().find(|(known, _)| known == parameter).map(|(_, name)| (*name).to_string());
        Constant::new(known.unwrap_or_else(|| short("AP", parameter)), parameter.row())
    });
    let global = GlobalParameter::ALL.iter().map(|parameter| Constant::new(short("GP", parameter), parameter.row()));
    let motor = Constant { name: "Motor0".into(), number: 0, note: "the axis" };
    axis.chain(global).chain([motor]).collect()
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
        Constant::new(name, parameter.row())
    });
    let others = WITHOUT_PARAMETER.iter().map(|&(name, number, note)| Constant { name: name.into(), number, note });
    let mut all: Vec<Constant> = configured.chain(others).collect();
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
        for name in ["TI_TIMER0 = 0 ", "TI_POSITION_REACHED0 = 3 ", "TI_STOP_LEFT0 = 27 ", "TI_GLOBAL = 255 "] {
            assert!(lines("Interrupts.inc").contains(&format!("\n{name}")), "{name}");
        }
        assert_eq!(text("Other.inc"), None);
        assert_eq!(file_with("ti_global"), Some("Interrupts.inc"));
    }

    #[test]
    fn every_parameter_has_a_name_of_its_own() {
        let all: Vec<String> = parameters().into_iter().chain(interrupts()).map(|c| c.name.to_lowercase()).collect();
        assert_eq!(parameters().len(), AxisParameter::COUNT + GlobalParameter::COUNT + 1);
        assert_eq!(interrupts().len(), InterruptParameter::COUNT + WITHOUT_PARAMETER.len());
        assert_eq!(all.iter().collect::<HashSet<_>>().len(), all.len());
    }
}
