//! The abort codes of SDO transfers (CiA 301).

/// Why an SDO request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Abort {
    /// The toggle bit has not changed.
    Toggle = 0x0503_0000,
    /// The command is not valid, or unknown.
    Command = 0x0504_0001,
    /// The object cannot be accessed this way now: a COB-ID or mapping while the PDO is valid.
    Access = 0x0601_0000,
    /// A read-only object was to be written.
    ReadOnly = 0x0601_0002,
    /// There is no object with this index.
    NoObject = 0x0602_0000,
    /// The object cannot be mapped to the PDO.
    NotMappable = 0x0604_0041,
    /// The objects to be mapped are too many, or too long for a PDO.
    MappingTooLong = 0x0604_0042,
    /// The EEPROM, or a chip of the motor, does not work.
    Hardware = 0x0606_0000,
    /// The length of the data is not the one that was announced.
    Length = 0x0607_0010,
    /// The data are longer than the object.
    TooLong = 0x0607_0012,
    /// The data are shorter than the object.
    TooShort = 0x0607_0013,
    /// There is no such sub-index.
    NoSubIndex = 0x0609_0011,
    /// The object does not take this value.
    Value = 0x0609_0030,
    /// The value is larger than the largest that the object takes.
    TooHigh = 0x0609_0031,
    /// The value is smaller than the smallest that the object takes.
    TooLow = 0x0609_0032,
    /// The signature that makes the module store or restore parameters is wrong.
    Signature = 0x0800_0020,
    /// Not in the present state of the device.
    State = 0x0800_0022,
}

impl Abort {
    /// The code on the bus.
    pub const fn code(self) -> u32 {
        self as u32
    }
}
