//! Parameters: what they do, and for each product a table with a row for each one it has.
//!
//! A row is read by the dispatcher (does the parameter exist, may it be written), by the range check, by
//! the settings (which slot), by the documentation (`docs/parameters.md`) and by the tests. What a parameter
//! *does* is a variant of an enum, [`AxisParameter`] or [`GlobalParameter`], with an exhaustive `match` over it elsewhere: one
//! without behaviour does not compile. Its number belongs to the row, because the same number means different things on
//! different products. Interrupts, and their parameters in bank 3, have the same numbers on all products.

mod axis;
mod global;
mod interrupt;
pub mod tmcm1140;

pub use axis::AxisParameter;
pub use global::{BAUD_RATES, CAN_BIT_RATES, GlobalParameter};
pub use interrupt::{ALL_INTERRUPTS, Each, INTERRUPTS, Interrupt, Numbered, TIMERS};

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

/// Whether a parameter survives power-off, and in which slot: a parameter of an axis counts them from the first one of its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// In RAM only.
    Volatile,
    /// Stored by STAP or STGP, restored at start-up.
    OnCommand(u8),
    /// Stored by the very command that sets it.
    Automatic(u8),
}

/// Every 32-bit value.
pub const ANY: &[(i32, i32)] = &[(i32::MIN, i32::MAX)];
/// 0 or 1.
pub const FLAG: &[(i32, i32)] = &[(0, 1)];

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
    /// Whether it survives power-off, and where.
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
        self.slot().is_some()
    }

    /// Its slot in the EEPROM, if it has one.
    pub const fn slot(&self) -> Option<u8> {
        match self.storage {
            Storage::Volatile => None,
            Storage::OnCommand(slot) | Storage::Automatic(slot) => Some(slot),
        }
    }

    /// Checked when a table is made: ranges ascend, and the default lies in one of them.
    const fn check(&self) {
        let (mut i, mut fits) = (0, false);
        while i < self.ranges.len() {
            let (low, high) = self.ranges[i];
            assert!(low <= high, "a range ends before it begins");
            assert!(i == 0 || self.ranges[i - 1].1 < low, "ranges overlap");
            fits |= low <= self.default && self.default <= high;
            i += 1;
        }
        assert!(fits, "a default is out of range");
    }
}

/// A parameter of a product: what it does, and its row.
#[derive(Debug)]
pub struct Parameter<F> {
    /// What it does.
    pub function: F,
    /// Everything else about it.
    pub row: Row,
}

/// The parameters of a product, in the order of their numbers.
#[derive(Debug)]
pub struct Table<F: 'static> {
    /// One for each parameter.
    pub rows: &'static [Parameter<F>],
    /// By number: the place among the rows, counted from 1; 0 for a number that is not there.
    places: [u8; 256],
}

impl<F: Copy + PartialEq> Table<F> {
    /// The parameter with this number, if the product has it.
    pub fn find(&self, number: u8) -> Option<&'static Parameter<F>> {
        let place = self.places.get(usize::from(number))?;
        self.rows.get(usize::from(*place).checked_sub(1)?)
    }

    /// The row of what does this, if the product has it. Looks through the table.
    pub fn row(&self, function: F) -> Option<&'static Row> {
        self.rows.iter().find(|parameter| parameter.function == function).map(|parameter| &parameter.row)
    }
}

/// Makes the enum of what parameters do, and the check of tables of it. What is set has a cell in an array of values; what is
/// computed when it is asked for has none.
macro_rules! functions {
    (
        $(#[$meta:meta])* $name:ident;
        settings { $($(#[$setting_meta:meta])* $setting:ident,)* }
        computed { $($(#[$computed_meta:meta])* $computed:ident,)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$setting_meta])* $setting,)*
            $($(#[$computed_meta])* $computed,)*
        }

        impl $name {
            /// Everything that parameters do.
            pub const ALL: &'static [$name] = &[$($name::$setting,)* $($name::$computed,)*];
            /// How many of them, from the first one on, have a cell in an array of values.
            pub const SETTINGS: usize = [$($name::$setting),*].len();

            /// Its cell in an array of [`SETTINGS`](Self::SETTINGS) values; beyond that for what is computed.
            pub const fn index(self) -> usize {
                self as usize
            }
        }

        impl $crate::param::Table<$name> {
            /// The table of these rows. That they are in order, and no number, function or slot is there twice, is checked when
            /// the table is made: in a `static` by the compiler.
            pub const fn new(rows: &'static [$crate::param::Parameter<$name>]) -> Self {
                let mut places = [0; 256];
                let mut slots = [false; 256];
                let mut functions = [false; $name::ALL.len()];
                let mut i = 0;
                while i < rows.len() {
                    let $crate::param::Parameter { function, row } = &rows[i];
                    row.check();
                    assert!(i == 0 || rows[i - 1].row.number < row.number, "numbers do not ascend");
                    assert!(!functions[*function as usize], "two parameters do the same");
                    functions[*function as usize] = true;
                    if let Some(slot) = row.slot() {
                        assert!(!slots[slot as usize], "two parameters have the same slot");
                        slots[slot as usize] = true;
                    }
                    i += 1;
                    places[row.number as usize] = i as u8;
                }
                $crate::param::Table { rows, places }
            }

            /// The factory defaults, by [`index`]($name::index); 0 for what the product does not have.
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

/// The rows of a table, one a line: number, function, name, unit, ranges, access, storage with its slot, default, note.
#[macro_export]
macro_rules! parameter_rows {
    (
        $functions:ident;
        $($number:literal $function:ident $name:literal $unit:ident $ranges:expr, $access:ident $storage:ident $(($slot:literal))? $default:literal $note:literal,)*
    ) => {
        &[$($crate::param::Parameter {
            function: $functions::$function,
            row: $crate::param::Row {
                number: $number,
                name: $name,
                unit: $crate::param::Unit::$unit,
                ranges: $ranges,
                access: $crate::param::Access::$access,
                storage: $crate::param::Storage::$storage $(($slot))?,
                default: $default,
                note: $note,
            },
        }),*]
    };
}
use crate::parameter_rows as rows;
