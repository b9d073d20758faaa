//! The stop switches and the home switch of an axis: which one stops which motion, and for how long its contacts
//! bounce.

/// Number of polls, one in a millisecond, after which the contacts of a switch have ceased to bounce: a level counts
/// that has been there in all of them.
pub(super) const SETTLED: u8 = 20;
/// Number of such polls for a move on a straight line, which is no line any more when one of its axes stands. A press
/// of 3 ms that stops a motor is seen by two polls whose positions are those of the polls before.
pub(super) const SETTLED_ON_LINE: u8 = 2;

/// The states of the switches of an axis, true is closed: the stop switches with the polarity of global parameter 79
/// applied, the home switch as its input is.
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
    /// The stop switch at the end to which `direction` points, which is positive or negative, not 0.
    pub(super) fn towards(self, direction: i32) -> bool {
        if direction > 0 { self.right } else { self.left }
    }
}

/// A stop switch, one of two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// The left stop switch, at the end of negative positions.
    #[default]
    Left,
    /// The right stop switch, at the end of positive positions.
    Right,
}

impl Side {
    /// The side to which `direction` points, which is positive or negative, not 0.
    pub(super) const fn towards(direction: i32) -> Self {
        if direction > 0 { Side::Right } else { Side::Left }
    }
}

/// The effect of closed stop switches on a motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stops {
    /// The left stop switch stops a motor that turns left.
    pub left: bool,
    /// The right stop switch stops a motor that turns right.
    pub right: bool,
    /// A stop switch stops the motor along the ramp, not at once.
    pub soft: bool,
    /// The stop switch whose opening latches the position, see [`StopSwitches::latch`](super::StopSwitches::latch);
    /// `None` if that is not wanted.
    pub latch: Option<Side>,
}

impl Stops {
    /// True if a closed stop switch stops the motor. `ahead` is the direction in which the motor is to turn, of which
    /// only the sign counts; the array says which stop switches are closed.
    pub(super) fn hold(self, ahead: i32, [left, right]: [bool; 2]) -> bool {
        match ahead {
            ..0 => left && self.left,
            0 => false,
            1.. => right && self.right,
        }
    }
}
