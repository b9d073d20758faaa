//! What an axis is told by pins and counters, not by its chips.

/// Inputs of an axis besides its chips, sampled once per poll.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sensors {
    /// SG_TST output of the driver: high while the load value is zero, so that the motor stalls.
    pub stall: bool,
    /// Home switch as it is: true is closed.
    pub home: bool,
    /// Angle of the built-in encoder, 0..=1023 in a turn.
    pub encoder: u16,
    /// Counter of the external ABN encoder, wrapping.
    pub external: u16,
    /// Counts of the external encoder at which its N track last became low, and high, since the poll before.
    pub null: [Option<u16>; 2],
}
