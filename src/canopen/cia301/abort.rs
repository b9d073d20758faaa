//! The abort codes of SDO transfers (CiA 301).

/// Makes the enum of abort codes, which are written one a line: code, name, meaning.
macro_rules! aborts {
    ($($code:literal $name:ident $meaning:literal;)*) => {
        /// Why an SDO request is refused.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u32)]
        pub enum Abort {
            $(#[doc = $meaning] $name = $code,)*
        }

        impl Abort {
            /// The reason with this code; `None` for one that a node never gives.
            pub const fn from_code(code: u32) -> Option<Self> {
                Some(match code {
                    $($code => Abort::$name,)*
                    _ => return None,
                })
            }

            /// The meaning of the code in English words.
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(Abort::$name => $meaning,)*
                }
            }
        }
    };
}

aborts! {
    0x0503_0000 Toggle "the toggle bit has not changed";
    0x0504_0001 Command "the command is not valid, or unknown";
    0x0601_0000 Access "the object cannot be accessed this way now: a COB-ID or mapping while the PDO is valid";
    0x0601_0002 ReadOnly "a read-only object was to be written";
    0x0602_0000 NoObject "there is no object with this index";
    0x0604_0041 NotMappable "the object cannot be mapped to the PDO";
    0x0604_0042 MappingTooLong "the objects to be mapped are too many, or too long for a PDO";
    0x0606_0000 Hardware "the EEPROM, or a chip of the motor, does not work";
    0x0607_0010 Length "the length of the data is not the one that was announced";
    0x0607_0012 TooLong "the data are longer than the object";
    0x0607_0013 TooShort "the data are shorter than the object";
    0x0609_0011 NoSubIndex "there is no such sub-index";
    0x0609_0030 Value "the object does not take this value";
    0x0609_0031 TooHigh "the value is larger than the largest that the object takes";
    0x0609_0032 TooLow "the value is smaller than the smallest that the object takes";
    0x0800_0020 Signature "the signature that makes the module store or restore parameters is wrong";
    0x0800_0022 State "not in the present state of the device";
}

impl Abort {
    /// The code on the bus.
    pub const fn code(self) -> u32 {
        self as u32
    }
}
