//! Faults that can be injected on the board, by name, and what disturbs its CAN controller.

use serde::Serialize;

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The EEPROM does not answer: its output stays high and it takes no commands.
    Eeprom,
    /// The motion bus reads all ones; what is sent to its chips still arrives.
    Spi,
    /// The motion bus reads all zeros; what is sent still arrives.
    SpiLow,
    /// The motion controller of the axis does not answer and takes no datagrams; other axes on it are silent as well.
    Tmc429,
    /// The driver does not answer and takes no datagrams.
    Tmc262,
    /// The TMC5160 of the axis does not answer and takes no datagrams.
    Tmc5160,
    /// The supply of the TMC5160 itself fails: the chip is in reset for as long as this lasts.
    ChipSupply,
    /// Short to ground at bridge A of the driver.
    ShortA,
    /// Short to ground at bridge B.
    ShortB,
    /// Coil A is not connected.
    OpenA,
    /// Coil B is not connected.
    OpenB,
    /// The driver is at its shutdown temperature, whatever the board's temperature is.
    Overtemperature,
    /// The built-in encoder's reading does not change any more.
    Encoder,
}

impl Fault {
    /// All faults.
    pub const ALL: [Self; 13] = [
        Self::Eeprom,
        Self::Spi,
        Self::SpiLow,
        Self::Tmc429,
        Self::Tmc262,
        Self::Tmc5160,
        Self::ChipSupply,
        Self::ShortA,
        Self::ShortB,
        Self::OpenA,
        Self::OpenB,
        Self::Overtemperature,
        Self::Encoder,
    ];

    /// The name the control protocol knows it by.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Eeprom => "eeprom",
            Self::Spi => "spi",
            Self::SpiLow => "spi-low",
            Self::Tmc429 => "tmc429",
            Self::Tmc262 => "tmc262",
            Self::Tmc5160 => "tmc5160",
            Self::ChipSupply => "chip-supply",
            Self::ShortA => "short-a",
            Self::ShortB => "short-b",
            Self::OpenA => "open-a",
            Self::OpenB => "open-b",
            Self::Overtemperature => "overtemperature",
            Self::Encoder => "encoder",
        }
    }

    /// Whether there is such a fault on each axis, not one on the whole board.
    pub const fn is_of_an_axis(self) -> bool {
        !matches!(self, Self::Eeprom | Self::Spi | Self::SpiLow)
    }

    /// Finds a fault by its name; the error lists the names there are.
    pub fn parse(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|fault| fault.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown fault '{name}'; there are: {names}")
        })
    }
}

/// The state that disturbances on the bus have brought the CAN controller into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CanState {
    /// The controller takes part in the bus.
    #[default]
    On,
    /// The controller takes part, but has met so many errors that it does not tell others of errors any more ("error
    /// passive").
    Passive,
    /// The controller takes no part any more: nothing leaves, and nothing arrives ("bus off").
    Off,
}

impl CanState {
    /// The state with this name in the control protocol.
    pub fn parse(name: &str) -> Result<Self, String> {
        match name {
            "on" => Ok(Self::On),
            "passive" => Ok(Self::Passive),
            "off" => Ok(Self::Off),
            _ => Err(format!("'{name}' is no state of a CAN controller; there are: passive, off, on")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_found_and_others_are_listed() {
        for fault in Fault::ALL {
            assert_eq!(Fault::parse(fault.name()), Ok(fault));
        }
        let error = Fault::parse("gremlins").unwrap_err();
        assert!(error.contains("gremlins") && error.contains("eeprom, spi, spi-low, tmc429"));
    }
}
