//! The parameter tables: every axis and global parameter of the manual in one row each.
//!
//! A row is read by the dispatcher (does the parameter exist, may it be written), by the range check, by
//! the store (which slot), by the documentation (`docs/parameters.md`) and by the tests. What a parameter
//! *does* is an exhaustive `match` over its enum elsewhere, so a row without behaviour does not compile.

mod axis;
mod global;
mod interrupt;

pub use axis::AxisParameter;
pub use global::{BAUD_RATES, CAN_BIT_RATES, GlobalParameter};
pub use interrupt::InterruptParameter;

/// Bit of global parameter 81 that hides the program.
pub const AGAINST_READING: i32 = 1;
/// Bit of global parameter 81 that keeps the program from being changed.
pub const AGAINST_WRITING: i32 = 2;

/// Number of user variables in bank 2 (manual section 5.3).
pub const USER_VARIABLES: usize = 256;
/// How many of them, from 0 on, can be stored in the EEPROM.
pub const STORED_USER_VARIABLES: usize = 56;
/// Coordinates per axis, 0..=20; number 0 lives in RAM only (manual section 3.7.24).
pub const COORDINATES: usize = 21;

/// What a parameter's number counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Microsteps of the resolution set by axis parameter 140.
    Microsteps,
    /// Internal velocity or acceleration units of the TMC429 (manual section 6.1).
    Internal,
    /// 0 or 1.
    Flag,
    /// One of a few numbered choices.
    Choice,
    /// A field of a chip's register as it is.
    Chip,
    /// 1/255 of the module's maximum current.
    Current,
    /// The exponent of a power of two.
    Exponent,
    /// Single bits.
    Bits,
    /// Hundredths of a second.
    TenMilliseconds,
    /// 1/512.
    Prescaler,
    /// Encoder steps.
    EncoderSteps,
    /// 1/1024 turn.
    Turn1024,
    /// n/32 of the full current.
    CurrentScale,
    /// 2^n microsteps per full step.
    MicrostepExponent,
    /// Milliseconds.
    Milliseconds,
    /// An address on the serial bus or in program memory.
    Address,
    /// An 11-bit CAN identifier.
    CanId,
    /// A plain number.
    Number,
}

impl Unit {
    /// The unit as it is printed behind a value; empty where a number speaks for itself.
    pub const fn symbol(self) -> &'static str {
        match self {
            Unit::Microsteps => "microsteps",
            Unit::Internal => "int",
            Unit::Current => "1/255",
            Unit::TenMilliseconds => "x10 ms",
            Unit::Prescaler => "1/512",
            Unit::EncoderSteps => "encoder steps",
            Unit::Turn1024 => "1/1024 turn",
            Unit::CurrentScale => "1/32",
            Unit::Milliseconds => "ms",
            Unit::Flag
            | Unit::Choice
            | Unit::Chip
            | Unit::Exponent
            | Unit::Bits
            | Unit::MicrostepExponent
            | Unit::Address
            | Unit::CanId
            | Unit::Number => "",
        }
    }
}

/// Who may change a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Read only: GAP, GGP.
    Read,
    /// Also SAP, AAP, SGP, AGP.
    ReadWrite,
}

/// Whether a parameter survives power-off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// In RAM only.
    Volatile,
    /// Stored by STAP or STGP, restored at start-up.
    OnCommand,
    /// Stored by the very command that sets it.
    Automatic,
}

/// Every 32-bit value.
const ANY: &[(i32, i32)] = &[(i32::MIN, i32::MAX)];
/// 0 or 1.
const FLAG: &[(i32, i32)] = &[(0, 1)];

/// One parameter.
#[derive(Debug)]
pub struct Row {
    /// Number in the type field of a command.
    pub number: u8,
    /// Name in the manual.
    pub name: &'static str,
    /// Unit of the value.
    pub unit: Unit,
    /// Accepted values: inclusive ranges, in ascending order.
    pub ranges: &'static [(i32, i32)],
    /// Who may change it.
    pub access: Access,
    /// Whether it survives power-off.
    pub storage: Storage,
    /// Value after a factory reset.
    pub default: i32,
    /// What it does, in a line.
    pub note: &'static str,
}

impl Row {
    /// True when `value` lies in one of the ranges.
    pub fn accepts(&self, value: i32) -> bool {
        self.ranges.iter().any(|&(low, high)| (low..=high).contains(&value))
    }

    /// True when SAP, SGP and their accumulator forms may change it.
    pub const fn writable(&self) -> bool {
        matches!(self.access, Access::ReadWrite)
    }

    /// True when the EEPROM has a slot for it.
    pub const fn stored(&self) -> bool {
        !matches!(self.storage, Storage::Volatile)
    }
}

/// Makes the enum of a table, its rows in the same order, and the ways from a number to a row.
macro_rules! parameters {
    (
        $(#[$meta:meta])* $table:ident;
        $($number:literal $variant:ident $name:literal $unit:ident $ranges:expr, $access:ident $storage:ident $default:literal $note:literal,)*
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $table {
            $(#[doc = concat!("Number ", $number, ", ", $name, ": ", $note, ".")] $variant,)*
        }

        impl $table {
            /// All parameters of the table, in the manual's order.
            pub const ALL: &'static [$table] = &[$($table::$variant),*];
            /// Number of rows.
            pub const COUNT: usize = Self::ALL.len();
            /// How many rows have a slot in the EEPROM.
            pub const STORED: usize = {
                let (mut i, mut count) = (0, 0);
                while i < Self::COUNT {
                    if Self::ROWS[i].stored() {
                        count += 1;
                    }
                    i += 1;
                }
                count
            };
            const ROWS: [Row; Self::COUNT] = [$(Row {
                number: $number,
                name: $name,
                unit: Unit::$unit,
                ranges: $ranges,
                access: Access::$access,
                storage: Storage::$storage,
                default: $default,
                note: $note,
            }),*];

            /// The parameter with this number, if there is one.
            pub const fn from_number(number: u8) -> Option<Self> {
                match number {
                    $($number => Some($table::$variant),)*
                    _ => None,
                }
            }

            /// The parameter's row.
            pub const fn row(self) -> &'static Row {
                match self {
                    $($table::$variant => const { &Self::ROWS[$table::$variant as usize] },)*
                }
            }

            /// The parameter's place in the table: its index into an array of values.
            pub const fn index(self) -> usize {
                self as usize
            }

            /// Position among the stored rows, or `None` for a volatile one.
            pub fn stored_index(self) -> Option<usize> {
                let before = Self::ALL.iter().take(self.index());
                self.row().stored().then(|| before.filter(|parameter| parameter.row().stored()).count())
            }

            /// The factory defaults, in table order.
            pub const fn defaults() -> [i32; Self::COUNT] {
                let mut values = [0; Self::COUNT];
                let mut i = 0;
                while i < Self::COUNT {
                    values[i] = Self::ROWS[i].default;
                    i += 1;
                }
                values
            }
        }
    };
}
use parameters;

#[cfg(test)]
mod tests {
    use super::*;

    /// The EEPROM addresses values by these positions: moving one would misread every module in the field.
    #[test]
    fn storage_slots_are_frozen() {
        let axis: Vec<(u8, usize)> =
            AxisParameter::ALL.iter().filter_map(|p| Some((p.row().number, p.stored_index()?))).collect();
        assert_eq!(axis.len(), AxisParameter::STORED);
        assert_eq!((axis[0], axis[9], axis[20]), ((4, 0), (149, 9), (167, 20)));
        assert_eq!(axis.last(), Some(&(218, 45)));
        let global: Vec<u8> =
            GlobalParameter::ALL.iter().filter(|p| p.stored_index().is_some()).map(|p| p.row().number).collect();
        assert_eq!(global, [65, 66, 67, 68, 69, 70, 71, 75, 76, 77, 79, 81, 82, 83, 84, 85, 87, 90]);
    }

    #[test]
    fn numbers_ascend_and_defaults_are_in_range() {
        fn check(rows: &[&Row]) {
            assert!(rows.windows(2).all(|w| w[0].number < w[1].number));
            for row in rows {
                assert!(row.accepts(row.default), "{}: default {} out of range", row.name, row.default);
                assert!(row.ranges.windows(2).all(|w| w[0].1 < w[1].0), "{}: ranges overlap", row.name);
            }
        }
        check(&AxisParameter::ALL.iter().map(|p| p.row()).collect::<Vec<_>>());
        check(&GlobalParameter::ALL.iter().map(|p| p.row()).collect::<Vec<_>>());
        check(&InterruptParameter::ALL.iter().map(|p| p.row()).collect::<Vec<_>>());
    }
}
