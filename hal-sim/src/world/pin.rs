//! The pins of an axis that a stage or an encoder is connected to.

use serde::Deserialize;

/// The three switches of an axis, in the order of their inputs on the TMCM-1140.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pin {
    /// The left stop switch, or track A of an encoder in its place.
    Left,
    /// The right stop switch, or track B.
    Right,
    /// The home switch, or track N.
    Home,
}

impl Pin {
    /// The name of the pin in world files and lines of the control port.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
            Self::Home => "home",
        }
    }

    /// The bit of this pin in a set of pins.
    pub(super) const fn bit(self) -> u8 {
        match self {
            Self::Left => 1,
            Self::Right => 2,
            Self::Home => 4,
        }
    }
}
