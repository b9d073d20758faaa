//! Stop switches and the home switch: which one stops which motion, and for how long its contacts bounce.

use crate::chip::tmc429::reference;

/// Polls, of a millisecond each, after which the contacts of a switch have ceased to bounce: a level counts that they
/// have had all that time.
pub(super) const SETTLED: u8 = 20;

/// The stop switches, with the polarity of global parameter 79 applied, and the home switch as it is: true is closed.
#[derive(Clone, Copy)]
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

/// True if a closed stop switch stops a motor on its way: the sign of `ahead` is the direction in which the motor is
/// to turn, `bits` are the reference switch bits of the TMC429 (register REF_CONF), which can disable either switch.
pub(super) fn stops(bits: u32, ahead: i32, left: bool, right: bool) -> bool {
    match ahead {
        ..0 => left && bits & reference::DISABLE_STOP_L == 0,
        0 => false,
        1.. => right && bits & reference::DISABLE_STOP_R == 0,
    }
}
