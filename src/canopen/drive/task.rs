//! The task that a motor is told.

use crate::units::Internal;

/// The task that the motor is to carry out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Task {
    /// To stand, after a ramp.
    #[default]
    Stand,
    /// To turn at this speed, in internal units.
    Turn(Internal),
    /// To go to this position, in microsteps.
    Go(i32),
}

impl Task {
    /// The direction in which the task leads from a position, as a sign.
    pub(super) fn direction(self, position: i32) -> i32 {
        match self {
            Task::Stand => 0,
            Task::Turn(speed) => speed.signum(),
            Task::Go(target) => target.cmp(&position) as i32,
        }
    }
}
