//! The orders of an axis, and those of them that its chips do not know yet.

use super::current::Current;
use super::pace::Pace;

/// Orders that the chips of an axis have not all taken. Each poll tells it again until they have. What
/// comes later here replaces what comes before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Untold {
    /// The chips know all of it.
    #[default]
    Nothing,
    /// The goal of the motor and its profile.
    Goal,
    /// The position of a motor that stands, and its goal.
    Position,
    /// A stop without a ramp.
    Stop,
}

/// The state of an axis that a command changes, besides the goal of the hardware and the reference search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orders<S> {
    /// The pace of the last motion command.
    pub(super) pace: Pace<S>,
    /// A positioning move of a host or a program is under way. Its end will be an event.
    pub(super) travelling: bool,
    /// The actual position was the target position at the last poll, and no other target has been given since.
    pub(super) was_at_target: bool,
    /// The motor has been stopped because an encoder deviates, and has not been sent anywhere since.
    pub(super) deviating: bool,
    /// The speed, in the unit of parameter 2, at which the motor was to turn when that
    /// [ended](super::Joined::end_at_switch) at a stop switch, until the next goal. Parameter 2 has it while the motor
    /// brakes there, and the motor counts as held by the switch.
    pub(super) ended: Option<i32>,
    /// Bits of parameter 207: why the motor was stopped, since the last motion command and the last reading of 207.
    pub(super) errors: i32,
    /// The driver's shut-downs since the last motion command, as bits of parameter 208.
    pub(super) alarms: u32,
    /// For how long the motor has been standing, on which its current depends.
    pub(super) current: Current,
}

impl<S> Default for Orders<S> {
    fn default() -> Self {
        Orders {
            pace: Pace::default(),
            travelling: false,
            was_at_target: true,
            deviating: false,
            ended: None,
            errors: 0,
            alarms: 0,
            current: Current::default(),
        }
    }
}
