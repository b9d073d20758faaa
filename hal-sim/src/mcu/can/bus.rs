//! The bus that the controller is connected to.

/// The bus beyond the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanBus {
    /// The bit rate of the bus.
    pub bit_rate: u32,
    /// Whether others are on it, who acknowledge frames.
    pub inhabited: bool,
    /// Whether its two wires touch each other: it is recessive whatever is sent.
    pub shorted: bool,
}

impl Default for CanBus {
    /// A sound bus of 1 Mbit/s with others on it.
    fn default() -> Self {
        Self { bit_rate: 1_000_000, inhabited: true, shorted: false }
    }
}
