//! A module that a scan has found, as a value, and as the line that is printed.

use std::fmt;

use crate::conversation::Identity;
use serde::Serialize;

/// Where a module has answered, and what it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub struct Found {
    /// The address of the module on a serial link.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<u16>,
    /// The identifier of the module on CAN.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identifier: Option<u16>,
    /// The bit rate of a serial device, in bit/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baud: Option<u32>,
    /// True on a link that leads to one module, whatever the address.
    pub alone: bool,
    /// The module's own address, if it has answered at its secondary one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub secondary_of: Option<u8>,
    /// The product of the module, such as `TMCM-1140`.
    pub product: String,
    /// Major and minor version of its firmware, such as `1.42`.
    pub firmware: String,
    /// The version string of the module (command 136, type 0), if it tells one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<String>,
}

impl Found {
    /// The product and the version of the firmware, from the value of the reply to `136, 1`.
    pub fn told(value: i32) -> (String, String) {
        let Identity { number, version, .. } = Identity::told(value);
        let firmware = version.map_or_else(String::new, |(major, minor)| format!("{major}.{minor:02}"));
        (format!("TMCM-{number}"), firmware)
    }
}

/// As it is printed for people.
impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.alone {
            f.write_str("one module, whatever the address: ")?;
        }
        match (self.address, self.identifier) {
            (_, Some(identifier)) => write!(f, "identifier {identifier}")?,
            (address, None) => write!(f, "address {}", address.unwrap_or_default())?,
        }
        if let Some(baud) = self.baud.filter(|_| !self.alone) {
            write!(f, " at {baud} baud")?;
        }
        write!(f, ": {}, firmware version {}", self.product, self.firmware)?;
        if let Some(version) = &self.version {
            write!(f, " ({version})")?;
        }
        match self.secondary_of {
            Some(own) => write!(f, ", the secondary address of module {own}"),
            None => Ok(()),
        }
    }
}
