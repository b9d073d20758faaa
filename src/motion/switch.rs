//! Stop switches and the home switch: which one stops which motion, and for how long its contacts bounce.

/// Polls, of a millisecond each, after which the contacts of a switch have ceased to bounce: a level counts that they
/// have had all that time.
pub(super) const SETTLED: u8 = 20;

/// The stop switches, with the polarity of global parameter 79 applied, and the home switch as it is: true is closed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Switches {
    /// The left stop switch, at the end of negative positions.
    pub left: bool,
    /// The right stop switch, at the end of positive positions.
    pub right: bool,
    /// The home switch.
    pub home: bool,
}

impl Switches {
    /// The stop switch in a direction, which is positive or negative.
    pub(super) fn towards(self, direction: i32) -> bool {
        if direction > 0 { self.right } else { self.left }
    }
}

/// One of the two stop switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// The one at the end of negative positions.
    #[default]
    Left,
    /// The one at the end of positive positions.
    Right,
}

/// What the stop switches do to a motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stops {
    /// The left one stops it.
    pub left: bool,
    /// The right one stops it.
    pub right: bool,
    /// They stop it along the ramp, not at once.
    pub soft: bool,
    /// The one at which a position can be kept, see [`Hardware::latch`](super::Hardware::latch).
    pub latch: Side,
}

impl Stops {
    /// True if a stop switch that is closed - left and right - stops a motor on its way: the sign of `ahead` is the
    /// direction in which the motor is to turn.
    pub(super) fn hold(self, ahead: i32, [left, right]: [bool; 2]) -> bool {
        match ahead {
            ..0 => left && self.left,
            0 => false,
            1.. => right && self.right,
        }
    }
}
