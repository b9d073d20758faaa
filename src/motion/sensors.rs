//! The inputs of an axis that come over pins and counters of the board, not from its motion controller and driver.

/// The inputs of one axis, sampled by the board once for each poll.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sensors {
    /// Level of the driver's output SG_TST, which is high while the load value is zero, that is, while the motor
    /// stalls.
    pub stall: bool,
    /// Level of the home switch's input; parameter 193 may invert its meaning.
    pub home: bool,
    /// Level of the right stop switch's input. Only an axis that watches this switch itself looks at it, see
    /// [`Axis::watch_right_switch`](super::Axis::watch_right_switch).
    pub right: bool,
    /// Angle of the built-in encoder, 0..=1023 within a turn; `None` where no such encoder is connected.
    pub encoder: Option<u16>,
    /// Counter of the external ABN encoder, which wraps at 65 536.
    pub external: u16,
    /// Counts of the external encoder at which its N track last became low, and last became high, since the poll
    /// before; `None` where it has not.
    pub null: [Option<u16>; 2],
}
