//! The file of settings: one TMCL command per line, which writes the setting.

use tmcm::param::{GlobalParameter, Row};
use tmcm::tmcl::{ALL_AXES, Command, Opcode, text};

use crate::product::{Product, numbers, stores_axes};

/// Begins a comment.
const COMMENT: &str = "//";
/// Begins the first line of a file, in front of what the module is whose settings these are.
pub(super) const TITLE: &str = "// Settings of a module ";
/// Bank of the user variables.
pub const VARIABLES: u8 = 2;

/// A setting of a module and its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// An axis parameter, written by SAP.
    Axis {
        /// Number of the parameter.
        number: u8,
        /// Number of the axis.
        axis: u8,
        /// Value in the unit of the parameter.
        value: i32,
    },
    /// A global parameter, written by SGP.
    Global {
        /// Number of the parameter.
        number: u8,
        /// Bank of the parameter.
        bank: u8,
        /// Value in the unit of the parameter.
        value: i32,
    },
    /// A coordinate, written by SCO.
    Coordinate {
        /// Number of the coordinate.
        number: u8,
        /// Number of the axis.
        axis: u8,
        /// Position in microsteps.
        value: i32,
    },
}

impl Setting {
    /// The setting that a command writes; `None` for any other command.
    pub(super) fn of(command: Command) -> Option<Self> {
        let Command { kind: number, motor, value, .. } = command;
        match Opcode::from_number(command.opcode)? {
            Opcode::Sap => Some(Setting::Axis { number, axis: motor, value }),
            Opcode::Sgp => Some(Setting::Global { number, bank: motor, value }),
            // SCO with all axes writes no coordinate but copies all of them between RAM and EEPROM.
            Opcode::Sco if motor != ALL_AXES => Some(Setting::Coordinate { number, axis: motor, value }),
            _ => None,
        }
    }

    /// The command that writes the setting.
    pub fn write(self) -> Command {
        match self {
            Setting::Axis { number, axis, value } => Command::new(Opcode::Sap as u8, number, axis, value),
            Setting::Global { number, bank, value } => Command::new(Opcode::Sgp as u8, number, bank, value),
            Setting::Coordinate { number, axis, value } => Command::new(Opcode::Sco as u8, number, axis, value),
        }
    }

    /// The command that reads the setting.
    pub fn read(self) -> Command {
        match self {
            Setting::Axis { number, axis, .. } => Command::new(Opcode::Gap as u8, number, axis, 0),
            Setting::Global { number, bank, .. } => Command::new(Opcode::Ggp as u8, number, bank, 0),
            Setting::Coordinate { number, axis, .. } => Command::new(Opcode::Gco as u8, number, axis, 0),
        }
    }

    /// The command that stores the setting in the EEPROM of a product. `None` for parameters of bank 0, which the
    /// module stores when they are written. `None` also for coordinates, which are stored all at once, and for axis
    /// parameters where they cannot be stored.
    pub fn store(self, product: Option<Product>) -> Option<Command> {
        match self {
            Setting::Axis { .. } if !stores_axes(product) => None,
            Setting::Axis { number, axis, .. } => Some(Command::new(Opcode::Stap as u8, number, axis, 0)),
            Setting::Global { number, bank: VARIABLES, .. } => {
                Some(Command::new(Opcode::Stgp as u8, number, VARIABLES, 0))
            }
            Setting::Global { .. } | Setting::Coordinate { .. } => None,
        }
    }

    /// The same setting with another value.
    pub fn with(self, value: i32) -> Self {
        match self {
            Setting::Axis { number, axis, .. } => Setting::Axis { number, axis, value },
            Setting::Global { number, bank, .. } => Setting::Global { number, bank, value },
            Setting::Coordinate { number, axis, .. } => Setting::Coordinate { number, axis, value },
        }
    }

    /// The value of the setting.
    pub fn value(self) -> i32 {
        self.write().value
    }

    /// The function of a global parameter of bank 0; `None` for other settings.
    pub fn global(self, product: Option<Product>) -> Option<GlobalParameter> {
        match self {
            Setting::Global { number, bank: 0, .. } => numbers(product).global.find(number).map(|found| found.function),
            _ => None,
        }
    }

    /// True for settings of the interfaces: two modules on a bus must not share them, or they would cut a module off.
    pub fn is_interface(self, product: Option<Product>) -> bool {
        use GlobalParameter as G;
        matches!(
            self.global(product),
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

    /// True for the same setting, whatever its value.
    pub fn is_same(self, other: Self) -> bool {
        self.with(0) == other.with(0)
    }

    /// The row about the parameter in the table of a product; `None` for variables and coordinates.
    pub fn row(self, product: Option<Product>) -> Option<&'static Row> {
        let spec = product?.spec();
        match self {
            Setting::Axis { number, .. } => spec.axis.find(number).map(|found| &found.row),
            Setting::Global { number, bank: 0, .. } => spec.global.find(number).map(|found| &found.row),
            Setting::Global { .. } | Setting::Coordinate { .. } => None,
        }
    }

    /// The setting's line in a file, with the name that the parameter has on a product as a comment.
    pub fn line(self, product: Option<Product>) -> String {
        match self.row(product) {
            Some(row) => format!("{} {COMMENT} {}", self.write(), row.name),
            None => self.write().to_string(),
        }
    }
}

/// The contents of a file of settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The number of the product whose settings these are; `None` in a file without a title.
    pub product: Option<u16>,
    /// The settings in the order of their lines.
    pub list: Vec<Setting>,
}

impl Settings {
    /// Reads what is in a file of this name.
    ///
    /// # Errors
    /// The message for the user, which names the file and the line.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        let list = parse(text).map_err(|error| format!("{name}:{error}"))?;
        Ok(Settings { product: product(text), list })
    }
}

/// The number of the product in the title of a file.
fn product(text: &str) -> Option<u16> {
    let what = text.lines().find_map(|line| line.trim().strip_prefix(TITLE))?;
    what.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
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

    const PRODUCT: Option<Product> = Some(Product::Tmcm1140);

    #[test]
    fn lines_are_read_as_they_are_written() {
        let speed = Setting::Axis { number: 4, axis: 0, value: 1000 };
        assert_eq!(speed.line(PRODUCT), "SAP 4, 0, 1000 // maximum positioning speed");
        let address = Setting::Global { number: 66, bank: 0, value: 3 };
        assert_eq!(address.line(PRODUCT), "SGP 66, 0, 3 // serial address");
        let coordinate = Setting::Coordinate { number: 20, axis: 0, value: -7 };
        assert_eq!(coordinate.line(PRODUCT), "SCO 20, 0, -7");
        let lines = format!(
            "// settings\n\n{}\n  {}\n{}",
            speed.line(PRODUCT),
            address.line(PRODUCT),
            coordinate.line(PRODUCT)
        );
        assert_eq!(parse(&lines), Ok(vec![speed, address, coordinate]));
    }

    #[test]
    fn errors_in_other_lines_have_the_line_number() {
        assert!(parse("// fine\nSAP 4, 0\n").unwrap_err().starts_with("2: SAP: missing <value>"));
        assert!(parse("ROR 0, 100\n").unwrap_err().starts_with("1: ROR 0, 100 is not a setting"));
        assert!(parse("SCO 0, 255, 0").is_err());
    }

    #[test]
    fn the_title_names_the_product() {
        assert_eq!(product("\n// Settings of a module 6110V146, saved by tmcl params\nSAP 4, 0, 7"), Some(6110));
        assert_eq!(product("// Settings of a module 3110, saved by tmcl params"), Some(3110));
        assert_eq!(product("// Settings of my own\nSAP 4, 0, 7"), None);
        // The names of parameters are those of the product.
        let home = Setting::Axis { number: 209, axis: 0, value: 7 };
        assert_eq!(home.line(PRODUCT), "SAP 209, 0, 7 // encoder position");
        assert_eq!(home.line(Some(Product::Tmcm6110)), "SAP 209, 0, 7");
        assert_eq!(home.line(None), "SAP 209, 0, 7");
    }

    #[test]
    fn settings_of_interfaces_are_recognised() {
        let of = |number, bank| Setting::Global { number, bank, value: 0 }.is_interface(PRODUCT);
        assert!([65, 66, 67, 69, 70, 71, 75, 76, 83, 87].iter().all(|number| of(*number, 0)));
        assert!([68, 77, 79, 82, 84, 85, 90].iter().all(|number| !of(*number, 0)));
        assert!(!of(66, 2));
    }
}
