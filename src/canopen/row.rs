//! What the object table says about an object.

/// What an index is: a single value, or a group of values of the same type or of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One value, at sub-index 0.
    Var,
    /// Values of the same type; sub-index 0 has the highest sub-index.
    Array,
    /// Values of several types; sub-index 0 has the highest sub-index.
    Record,
}

/// Type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// UNSIGNED8.
    U8,
    /// UNSIGNED16.
    U16,
    /// UNSIGNED32.
    U32,
    /// UNSIGNED64.
    U64,
    /// INTEGER8.
    I8,
    /// INTEGER16.
    I16,
    /// INTEGER32.
    I32,
    /// VISIBLE_STRING; the objects of this type are only read.
    Text,
    /// OCTET_STRING; the objects of this type have seven bytes.
    Octets,
}

impl Type {
    /// The number of the type in CiA 301, as an EDS has it.
    pub const fn number(self) -> u8 {
        match self {
            Type::I8 => 0x02,
            Type::I16 => 0x03,
            Type::I32 => 0x04,
            Type::U8 => 0x05,
            Type::U16 => 0x06,
            Type::U32 => 0x07,
            Type::Text => 0x09,
            Type::Octets => 0x0A,
            Type::U64 => 0x1B,
        }
    }

    /// Number of bytes that are written to an object of this type.
    pub const fn size(self) -> usize {
        match self {
            Type::U8 | Type::I8 => 1,
            Type::U16 | Type::I16 => 2,
            Type::U32 | Type::I32 => 4,
            Type::Octets => 7,
            Type::U64 => 8,
            Type::Text => 0,
        }
    }

    /// The smallest and the largest number of this type.
    pub const fn range(self) -> (i64, i64) {
        match self {
            Type::U8 => (0, u8::MAX as i64),
            Type::U16 => (0, u16::MAX as i64),
            Type::U32 => (0, u32::MAX as i64),
            Type::I8 => (i8::MIN as i64, i8::MAX as i64),
            Type::I16 => (i16::MIN as i64, i16::MAX as i64),
            Type::I32 => (i32::MIN as i64, i32::MAX as i64),
            Type::U64 | Type::Text | Type::Octets => (i64::MIN, i64::MAX),
        }
    }

    /// The number that four bytes stand for, of which those behind the size of the type are ignored. Signed types are
    /// extended to 32 bits.
    pub const fn extend(self, bytes: u32) -> u32 {
        match self {
            Type::U8 => bytes as u8 as u32,
            Type::U16 => bytes as u16 as u32,
            Type::I8 => bytes as i8 as i32 as u32,
            Type::I16 => bytes as i16 as i32 as u32,
            Type::U32 | Type::I32 | Type::U64 | Type::Text | Type::Octets => bytes,
        }
    }

    /// The value of a number as [`Type::extend`] gives it.
    pub const fn value(self, number: u32) -> i64 {
        match self {
            Type::I8 | Type::I16 | Type::I32 => number as i32 as i64,
            Type::U8 | Type::U16 | Type::U32 | Type::U64 | Type::Text | Type::Octets => number as i64,
        }
    }
}

/// Who may change an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The object is only read.
    Ro,
    /// The object is read and written.
    Rw,
}

/// In which PDOs an object may be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// In none.
    No,
    /// In those that the node sends.
    Tx,
    /// In those that it sends and in those that it receives.
    RxTx,
}

/// Where the value of an object is, and which groups of 1010h and 1011h it belongs to. The number is that of the first
/// slot in the EEPROM; the PDOs have one slot each, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// The value is found, or what is written is done, by the firmware.
    Computed,
    /// In RAM only.
    Volatile,
    /// Saved with all parameters.
    All(u8),
    /// Saved with all parameters, and with those of the motor.
    Motor(u8),
    /// Saved with all parameters, and with bit rate and node ID.
    Communication(u8),
}

/// The value of an object after a factory reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initial {
    /// A number.
    Number(i64),
    /// A number for each of the four PDOs.
    Each([i64; 4]),
    /// A COB-ID to which the node ID is added; with each further PDO it is 100h more.
    PlusNode(u32),
    /// A text.
    Text(&'static str),
    /// Nothing that could be said beforehand.
    Varies,
}

/// The states in which an object may be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// In all.
    Always,
    /// While the drive is in the state SWITCH ON DISABLED.
    Disabled,
}

/// Ranges of an object that takes every number of its type.
pub const ANY: &[(i64, i64)] = &[];

/// A row of the object table. Objects that each PDO has stand in one row. Names and units are for people, so an image has none.
#[derive(Debug)]
pub struct Row {
    /// The index, or that of the first PDO.
    pub first: u16,
    /// The index, or that of the last PDO.
    pub last: u16,
    /// The sub-index.
    pub sub: u8,
    /// The name. A `#` in it stands for the number of the PDO. At sub-index 0 of an array or a record the name of the
    /// whole stands in front of a colon.
    #[cfg(not(target_os = "none"))]
    pub name: &'static str,
    /// What the index is.
    pub kind: Kind,
    /// Type of the value.
    pub data: Type,
    /// Whether the object may be written.
    pub access: Access,
    /// Whether the object may be mapped.
    pub mapping: Mapping,
    /// Accepted values, besides what the type allows: inclusive ranges, in ascending order; with [`ANY`] all.
    pub ranges: &'static [(i64, i64)],
    /// The value after a factory reset.
    pub default: Initial,
    /// The unit of the value; empty where a number speaks for itself.
    #[cfg(not(target_os = "none"))]
    pub unit: &'static str,
    /// Where the value is.
    pub storage: Storage,
    /// When the object may be written.
    pub when: When,
}

impl Row {
    /// True when the number lies in one of the ranges.
    pub fn accepts(&self, value: i64) -> bool {
        self.ranges.is_empty() || self.ranges.iter().any(|&(low, high)| (low..=high).contains(&value))
    }

    /// The number after a factory reset, of the PDO with this number, counted from 0, on the node with this ID; 0 where
    /// the default is none.
    pub const fn default_number(&self, nth: u8, node: u8) -> u32 {
        match self.default {
            Initial::Number(number) => number as u32,
            Initial::Each([first, second, third, fourth]) => match nth {
                0 => first as u32,
                1 => second as u32,
                2 => third as u32,
                _ => fourth as u32,
            },
            Initial::PlusNode(base) => base.wrapping_add((nth as u32).wrapping_mul(0x100)).wrapping_add(node as u32),
            Initial::Text(_) | Initial::Varies => 0,
        }
    }

    /// Number of indices that have this row.
    pub const fn count(&self) -> u8 {
        self.last.wrapping_sub(self.first).wrapping_add(1) as u8
    }

    /// The slot in the EEPROM of the PDO with this number, counted from 0; `None` if the value is not saved.
    pub const fn slot(&self, nth: u8) -> Option<usize> {
        match self.storage {
            Storage::Computed | Storage::Volatile => None,
            Storage::All(slot) | Storage::Motor(slot) | Storage::Communication(slot) => {
                Some((slot as usize).wrapping_add(nth as usize))
            }
        }
    }

    /// True for a COB-ID whose default has the node ID in it.
    pub const fn follows_node(&self) -> bool {
        matches!(self.default, Initial::PlusNode(_))
    }
}
