//! The facts that the object table has about an object.

/// The kind of an index: a single value, or a group of values of the same type or of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A single value, at sub-index 0.
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

/// How the value of an object becomes that of an axis parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As it is.
    Same,
    /// The end of the hysteresis: the object is signed, the chip's field begins at -3.
    HysteresisEnd,
    /// A velocity in the unit of 208Ch from which on something acts.
    Threshold,
}

/// Ranges of an object that takes every number of its type.
pub const ANY: &[(i64, i64)] = &[];
