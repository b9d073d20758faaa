//! The pins of the module that a stage or an encoder is connected to.

use serde::Deserialize;

/// The three digital inputs, in the order of their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pin {
    /// IN1: left stop switch, encoder track A.
    Left,
    /// IN2: right stop switch, encoder track B.
    Right,
    /// IN3: home switch, encoder track N.
    Home,
}

impl Pin {
    /// Its bit in a set of pins: bit 0 is IN1.
    pub(super) const fn bit(self) -> u8 {
        match self {
            Self::Left => 1,
            Self::Right => 2,
            Self::Home => 4,
        }
    }
}
