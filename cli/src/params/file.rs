//! Settings as lines of TMCL: what may stand in the file, and reading it.

use std::path::Path;

use tmcm::module::Spec;
use tmcm::param::GlobalParameter;
use tmcm::tmcl::{ALL_AXES, Command, Opcode, text};

use crate::failure::Failure;
use crate::files::read_text;

/// Begins a comment.
const COMMENT: &str = "//";
/// Bank of the user variables.
pub(super) const VARIABLES: u8 = 2;

/// A setting: the command that writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Setting {
    /// SAP.
    Axis {
        /// Number of the parameter.
        number: u8,
        /// Number of the axis.
        axis: u8,
        /// Its value.
        value: i32,
    },
    /// SGP.
    Global {
        /// Number of the parameter.
        number: u8,
        /// Its bank.
        bank: u8,
        /// Its value.
        value: i32,
    },
    /// SCO.
    Coordinate {
        /// Number of the coordinate.
        number: u8,
        /// Number of the axis.
        axis: u8,
        /// Its value.
        value: i32,
    },
}

impl Setting {
    /// The setting that a command writes, if it writes one.
    fn of(command: Command) -> Option<Self> {
        let Command { kind: number, motor, value, .. } = command;
        match Opcode::from_number(command.opcode)? {
            Opcode::Sap => Some(Setting::Axis { number, axis: motor, value }),
            Opcode::Sgp => Some(Setting::Global { number, bank: motor, value }),
            // With all axes it copies between RAM and EEPROM.
            Opcode::Sco if motor != ALL_AXES => Some(Setting::Coordinate { number, axis: motor, value }),
            _ => None,
        }
    }

    /// The command that writes it.
    pub(super) fn write(self) -> Command {
        match self {
            Setting::Axis { number, axis, value } => Command::new(Opcode::Sap as u8, number, axis, value),
            Setting::Global { number, bank, value } => Command::new(Opcode::Sgp as u8, number, bank, value),
            Setting::Coordinate { number, axis, value } => Command::new(Opcode::Sco as u8, number, axis, value),
        }
    }

    /// The command that reads it.
    pub(super) fn read(self) -> Command {
        match self {
            Setting::Axis { number, axis, .. } => Command::new(Opcode::Gap as u8, number, axis, 0),
            Setting::Global { number, bank, .. } => Command::new(Opcode::Ggp as u8, number, bank, 0),
            Setting::Coordinate { number, axis, .. } => Command::new(Opcode::Gco as u8, number, axis, 0),
        }
    }

    /// The command that stores it in the EEPROM. Bank 0 is stored by being written, coordinates are stored all at once.
    pub(super) fn store(self) -> Option<Command> {
        match self {
            Setting::Axis { number, axis, .. } => Some(Command::new(Opcode::Stap as u8, number, axis, 0)),
            Setting::Global { number, bank: VARIABLES, .. } => {
                Some(Command::new(Opcode::Stgp as u8, number, VARIABLES, 0))
            }
            Setting::Global { .. } | Setting::Coordinate { .. } => None,
        }
    }

    /// The same setting with another value.
    pub(super) fn with(self, value: i32) -> Self {
        match self {
            Setting::Axis { number, axis, .. } => Setting::Axis { number, axis, value },
            Setting::Global { number, bank, .. } => Setting::Global { number, bank, value },
            Setting::Coordinate { number, axis, .. } => Setting::Coordinate { number, axis, value },
        }
    }

    /// Its value.
    pub(super) fn value(self) -> i32 {
        self.write().value
    }

    /// What the global parameter of bank 0 that it is does.
    pub(super) fn global(self, spec: &Spec) -> Option<GlobalParameter> {
        match self {
            Setting::Global { number, bank: 0, .. } => spec.global.find(number).map(|found| found.function),
            _ => None,
        }
    }

    /// How the module is reached: what must not be the same on another module of the bus, or would cut it off.
    pub(super) fn is_interface(self, spec: &Spec) -> bool {
        use GlobalParameter as G;
        matches!(
            self.global(spec),
            Some(
                G::SerialBaudRate
                    | G::SerialAddress
                    | G::AsciiMode
                    | G::CanBitRate
                    | G::CanReplyId
                    | G::CanId
                    | G::TelegramPause
                    | G::SerialHostAddress
                    | G::CanSecondaryId
                    | G::SerialSecondaryAddress
            )
        )
    }

    /// The line of the file, with the setting's name.
    pub(super) fn line(self, spec: &Spec) -> String {
        let row = match self {
            Setting::Axis { number, .. } => spec.axis.find(number).map(|found| &found.row),
            Setting::Global { number, bank: 0, .. } => spec.global.find(number).map(|found| &found.row),
            Setting::Global { .. } | Setting::Coordinate { .. } => None,
        };
        match row {
            Some(row) => format!("{} {COMMENT} {}", self.write(), row.name),
            None => self.write().to_string(),
        }
    }
}

/// Reads a file of settings.
pub(super) fn read(path: &Path) -> Result<Vec<Setting>, Failure> {
    let shown = path.display();
    let text = read_text(path).map_err(|error| Failure::Failed(format!("cannot read {shown}: {error}")))?;
    parse(&text).map_err(|error| Failure::Failed(format!("{shown}:{error}")))
}

/// Reads the lines of a file; an error begins with the number of the line.
fn parse(text: &str) -> Result<Vec<Setting>, String> {
    let lines = (1..).zip(text.lines());
    let commands = lines.map(|(number, line)| (number, line.split(COMMENT).next().unwrap_or_default().trim()));
    let commands = commands.filter(|(_, line)| !line.is_empty());
    let settings = commands.map(|(number, line)| {
        let command = text::parse(line).map_err(|error| format!("{number}: {error}"))?;
        Setting::of(command).ok_or_else(|| format!("{number}: {command} is not a setting; only SAP, SGP and SCO are"))
    });
    settings.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::product::PRODUCT;

    #[test]
    fn lines_are_read_as_they_are_written() {
        let speed = Setting::Axis { number: 4, axis: 0, value: 1000 };
        assert_eq!(speed.line(PRODUCT), "SAP 4, 0, 1000 // maximum positioning speed");
        let address = Setting::Global { number: 66, bank: 0, value: 3 };
        assert_eq!(address.line(PRODUCT), "SGP 66, 0, 3 // serial address");
        let place = Setting::Coordinate { number: 20, axis: 0, value: -7 };
        assert_eq!(place.line(PRODUCT), "SCO 20, 0, -7");
        let lines =
            format!("// settings\n\n{}\n  {}\n{}", speed.line(PRODUCT), address.line(PRODUCT), place.line(PRODUCT));
        assert_eq!(parse(&lines), Ok(vec![speed, address, place]));
    }

    #[test]
    fn other_lines_are_told_with_their_number() {
        assert!(parse("// fine\nSAP 4, 0\n").unwrap_err().starts_with("2: SAP: missing <value>"));
        assert!(parse("ROR 0, 100\n").unwrap_err().starts_with("1: ROR 0, 100 is not a setting"));
        assert!(parse("SCO 0, 255, 0").is_err());
    }

    #[test]
    fn interfaces_are_told_from_the_rest() {
        let of = |number, bank| Setting::Global { number, bank, value: 0 }.is_interface(PRODUCT);
        assert!([65, 66, 67, 69, 70, 71, 75, 76, 83, 87].iter().all(|number| of(*number, 0)));
        assert!([68, 77, 79, 82, 84, 85, 90].iter().all(|number| !of(*number, 0)));
        assert!(!of(66, 2));
    }
}
