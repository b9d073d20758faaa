//! Parameters: their functions, and the table with one row per parameter that each product has of them.
//!
//! A row is read by the dispatcher (does the parameter exist, may it be written), by the range check, and by the
//! settings (which slot). The documentation (`docs/parameters-*.md`) and the tests read it, too. The function of a
//! parameter is a variant of [`AxisParameter`] or [`GlobalParameter`]. The list of axis parameters says what reading
//! and writing each of them takes. The firmware matches exhaustively on those for which it does something special, and
//! on all global parameters. So a function without behaviour does not compile. The number of a parameter belongs to the
//! row, because the same number means different things on different products. Interrupts, and their parameters in bank
//! 3, have the same numbers on all products.

mod axis;
mod global;
mod interrupt;
mod rows;

pub use axis::AxisParameter;
pub(crate) use axis::{Computed, Source, Special, Writing};
pub use global::{BAUD_RATES, CAN_BIT_RATES, GlobalParameter};
pub use interrupt::{ALL_INTERRUPTS, INTERRUPTS, Interrupt, Numbered, Per, TIMERS};
pub(crate) use rows::{count, derived, merge, rows, unstored};

use rows::demand;

/// Bit of global parameter 81 that keeps a host from reading the program.
pub const AGAINST_READING: i32 = 1;
/// Bit of global parameter 81 that keeps a host from changing the program.
pub const AGAINST_WRITING: i32 = 2;

/// Number of user variables in bank 2 (manual section 5.3).
pub const USER_VARIABLES: usize = 256;
/// Number of user variables, from variable 0 on, that can be stored in the EEPROM.
pub const STORED_USER_VARIABLES: usize = 56;
/// Coordinates per axis, 0..=20; number 0 lives in RAM only (manual section 3.7.24).
pub const COORDINATES: usize = 21;

/// Unit of a parameter's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Microsteps of the resolution set by axis parameter 140.
    Microsteps,
    /// Internal velocity or acceleration units of the TMC429 (manual section 6.1).
    Internal,
    /// A flag, 0 or 1.
    Flag,
    /// The number of a choice.
    Choice,
    /// The value of a field in a chip's register.
    Chip,
    /// 1/255 of the module's maximum current.
    Current,
    /// The exponent of a power of two.
    Exponent,
    /// A set of bits.
    Bits,
    /// Hundredths of a second.
    TenMilliseconds,
    /// Microsteps per encoder step, in 1/512.
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
    /// Microsteps per second.
    Pps,
    /// Microsteps per second in each second.
    Pps2,
    /// 32 microseconds, 512 clocks of 16 MHz.
    Clocks512,
    /// 16.384 milliseconds, 2^18 clocks of 16 MHz.
    Clocks2To18,
    /// Full steps per turn of the motor.
    FullStepsPerTurn,
    /// Counts per turn of an encoder.
    CountsPerTurn,
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
            Unit::Pps => "pps",
            Unit::Pps2 => "pps2",
            Unit::Clocks512 => "x32 us",
            Unit::Clocks2To18 => "x16.384 ms",
            Unit::FullStepsPerTurn => "full steps/turn",
            Unit::CountsPerTurn => "counts/turn",
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

/// The access to a parameter: who may change it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Hosts and programs may read the parameter with GAP or GGP.
    Read,
    /// Hosts and programs may also write the parameter with SAP, AAP, SGP or AGP.
    ReadWrite,
}

/// Whether a parameter survives power-off, and in which slot of the EEPROM. Slots of an axis parameter count from the
/// first slot of the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// In RAM only.
    Volatile,
    /// Stored by STAP or STGP, restored at start-up.
    OnCommand(u8),
    /// Stored by each command that sets the parameter.
    Automatic(u8),
}

/// Range of a parameter that takes every 32-bit value.
pub const ANY: &[(i32, i32)] = &[(i32::MIN, i32::MAX)];
/// Range of a parameter that takes 0 or 1.
pub const FLAG: &[(i32, i32)] = &[(0, 1)];

/// All that a product's table says about a parameter. Names and remarks are for people, so an image has none: it would
/// grow by some kilobytes.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Number in the type field of a command.
    pub number: u8,
    /// Name in the manual.
    #[cfg(not(target_os = "none"))]
    pub name: &'static str,
    /// Unit of the value.
    pub unit: Unit,
    /// Accepted values: inclusive ranges, in ascending order.
    pub ranges: &'static [(i32, i32)],
    /// Whether commands may change the value.
    pub access: Access,
    /// Whether the value survives power-off, and in which slot.
    pub storage: Storage,
    /// Value after a factory reset.
    pub default: i32,
    /// Remark for the documentation, in one line.
    #[cfg(not(target_os = "none"))]
    pub note: &'static str,
}

impl Row {
    /// True when `value` lies in one of the ranges.
    pub fn accepts(&self, value: i32) -> bool {
        self.ranges.iter().any(|&(low, high)| (low..=high).contains(&value))
    }

    /// True when SAP, SGP, AAP and AGP may change the parameter.
    pub const fn writable(&self) -> bool {
        matches!(self.access, Access::ReadWrite)
    }

    /// True when the parameter has a slot in the EEPROM.
    pub const fn stored(&self) -> bool {
        self.slot().is_some()
    }

    /// The parameter's slot in the EEPROM; `None` if the value is lost at power-off.
    pub const fn slot(&self) -> Option<u8> {
        match self.storage {
            Storage::Volatile => None,
            Storage::OnCommand(slot) | Storage::Automatic(slot) => Some(slot),
        }
    }

    /// True if all accepted values are 0..=255.
    const fn fits_byte(&self) -> bool {
        let last = self.ranges[self.ranges.len() - 1];
        0 <= self.ranges[0].0 && last.1 <= u8::MAX as i32
    }

    /// Panics, at compile time for a table in a `static`, unless the ranges ascend and one of them holds the default.
    #[track_caller]
    const fn check(&self) {
        let (mut i, mut fits) = (0, false);
        while i < self.ranges.len() {
            let (low, high) = self.ranges[i];
            demand(low <= high, self.number, "has a range that ends before it begins");
            demand(i == 0 || self.ranges[i - 1].1 < low, self.number, "has ranges that overlap");
            fits |= low <= self.default && self.default <= high;
            i += 1;
        }
        demand(fits, self.number, "has a default out of its range");
    }
}

/// A parameter of a product: its function and its row.
#[derive(Clone, Copy, Debug)]
pub struct Parameter<F> {
    /// The function: a variant of [`AxisParameter`] or [`GlobalParameter`].
    pub function: F,
    /// Number, range, unit and the rest of the table's row.
    pub row: Row,
}

/// The parameters of a product, in the order of their numbers.
#[derive(Debug)]
pub struct Table<F: 'static> {
    /// The parameters.
    pub rows: &'static [Parameter<F>],
    /// For each parameter number its position in `rows`, counted from 1; 0 if the product has no such parameter.
    positions: [u8; 256],
}

impl<F: Copy + PartialEq> Table<F> {
    /// The parameter with this number, if the product has it.
    pub fn find(&self, number: u8) -> Option<&'static Parameter<F>> {
        let position = self.positions.get(usize::from(number))?;
        self.rows.get(usize::from(*position).checked_sub(1)?)
    }

    /// The row of the parameter with this function, if the product has it. The table is searched, which takes longer
    /// than [`Table::find`].
    pub fn row(&self, function: F) -> Option<&'static Row> {
        self.rows.iter().find(|parameter| parameter.function == function).map(|parameter| &parameter.row)
    }
}

/// Makes an enum of parameter functions, and the constructor of tables for it. The value of a setting is kept in an
/// array of values, or of bytes if it is 0..=255 on all products. The value of a computed parameter is found when it is
/// read.
macro_rules! functions {
    (
        $(#[$meta:meta])* $name:ident;
        settings { $($(#[$setting_meta:meta])* $setting:ident,)* }
        $(bytes { $($(#[$byte_meta:meta])* $byte:ident,)* })?
        computed { $($(#[$computed_meta:meta])* $computed:ident,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$setting_meta])* $setting,)*
            $($($(#[$byte_meta])* $byte,)*)?
            $($(#[$computed_meta])* $computed,)*
        }

        impl $name {
            /// All functions: settings first, those of a byte behind the others, then computed parameters.
            pub const ALL: &'static [$name] =
                &[$($name::$setting,)* $($($name::$byte,)*)? $($name::$computed,)*];
            /// Number of settings: the length of an array of their values.
            pub const SETTINGS: usize = Self::WORDS + Self::BYTES;
            /// Number of settings that may take more than a byte.
            pub(crate) const WORDS: usize = [$($name::$setting),*].len();
            /// Number of settings that take a byte, 0..=255.
            pub(crate) const BYTES: usize = { let all: &[$name] = &[$($($name::$byte),*)?]; all.len() };

            /// Index of a setting in an array of [`SETTINGS`](Self::SETTINGS) values; for a computed parameter an index
            /// beyond that array.
            pub const fn index(self) -> usize {
                self as usize
            }
        }

        impl $crate::param::Table<$name> {
            /// The table with these rows.
            ///
            /// # Panics
            /// The numbers do not ascend, or two rows have the same function or slot. For a table in a `static` this
            /// is a compile error.
            #[track_caller]
            pub const fn new(rows: &'static [$crate::param::Parameter<$name>]) -> Self {
                use $crate::param::demand;
                let mut positions = [0; 256];
                let mut slots = [false; 256];
                let mut functions = [false; $name::ALL.len()];
                let mut i = 0;
                while i < rows.len() {
                    let $crate::param::Parameter { function, row } = &rows[i];
                    row.check();
                    let byte = $name::WORDS <= function.index() && function.index() < $name::SETTINGS;
                    let after = i == 0 || rows[i - 1].row.number < row.number;
                    demand(after, row.number, "stands behind a number that is not lower");
                    demand(!byte || row.fits_byte(), row.number, "is not 0..=255, as its place among the bytes says");
                    demand(!functions[*function as usize], row.number, "has the function of another one");
                    functions[*function as usize] = true;
                    if let Some(slot) = row.slot() {
                        demand(!slots[slot as usize], row.number, "has the slot of another one");
                        slots[slot as usize] = true;
                    }
                    i += 1;
                    positions[row.number as usize] = i as u8;
                }
                $crate::param::Table { rows, positions }
            }

            /// The factory defaults of all settings, by [`index`]($name::index); 0 for a setting that the product does
            /// not have.
            pub fn defaults(&self) -> [i32; $name::SETTINGS] {
                let mut values = [0; $name::SETTINGS];
                for parameter in self.rows {
                    if let Some(value) = values.get_mut(parameter.function.index()) {
                        *value = parameter.row.default;
                    }
                }
                values
            }
        }
    };
}
use functions;
