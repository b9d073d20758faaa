//! The ports of SIO and GIO (manual sections 3.7.14, 3.7.15): their banks, and the numbers of those that are no input
//! or output of a row of equal ones.

/// Bank of the digital inputs, and, for SIO, of the pull-up resistors.
pub const INPUTS: u8 = 0;
/// Bank of the analog inputs.
pub const ANALOG: u8 = 1;
/// Bank of the digital outputs.
pub const OUTPUTS: u8 = 2;
/// The port that stands for all ports of a bank together.
pub const ALL_PORTS: u8 = 255;

/// A signal that a product has once, under a port number of its own. Which of them a product has says its
/// [`Spec`](super::Spec).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// The supply voltage, in 0.1 V.
    Supply,
    /// The supply voltage, as the converter reads it behind its divider.
    SupplyReading,
    /// The 5 V supply of the logic, as the converter reads it behind its divider.
    LogicSupplyReading,
    /// The temperature of the module, in degrees Celsius.
    Temperature,
    /// The level of the input that enables the drivers.
    Enable,
    /// 1 while the built-in encoder is at the zero of its turn.
    EncoderZero,
}

impl Signal {
    /// The bank and the port of the signal.
    pub const fn place(self) -> (u8, u8) {
        match self {
            Signal::Supply => (ANALOG, 8),
            Signal::SupplyReading => (ANALOG, 1),
            Signal::LogicSupplyReading => (ANALOG, 2),
            Signal::Temperature => (ANALOG, 9),
            Signal::Enable => (INPUTS, 10),
            Signal::EncoderZero => (INPUTS, 11),
        }
    }
}
