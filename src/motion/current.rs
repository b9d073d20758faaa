//! The current of the motor: run, boost, slow run, standby or none (manual chapter 4, parameters 6, 7, 150, 182, 183,
//! 200, 204 and 214).
//!
//! A moving motor has the boost current (200) while its speed changes, else the slow run current (183) below the speed
//! of parameter 182, else the run current (6). Where 200 or 183 is 0, the next current in this order applies.
//!
//! A motor that a stop switch holds keeps the run current as long as parameter 150 is 0. Neither the slow run current
//! (183), nor standby (214), nor freewheeling (204) applies, although the motor stands. With 150 at 1 such a motor is
//! treated like any other that stands: standby and freewheeling begin after their times.

use super::values::Values;
use crate::param::AxisParameter as P;
use crate::units::{CurrentScale, Micros};

/// The state of motion, as far as the current depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionState {
    /// The motor stands; or a stop switch holds it, and parameter 150 says that the motor then counts as standing.
    Standing,
    /// A stop switch holds the motor, and the motor keeps the run current.
    Held,
    /// The motor accelerates or brakes, or is about to make its first step.
    Changing,
    /// The motor turns at its commanded speed.
    Cruising,
}

/// How the windings are driven: the part of the driver's configuration that follows the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Excitation {
    /// Current of the coils, when the bridges are on.
    pub scale: CurrentScale,
    /// The bridges are off: the motor has no current and turns freely.
    pub free: bool,
    /// coolStep may reduce the current. It may do so only from the speed of parameter 182 on.
    pub cool_step: bool,
}

/// The state on which the choice of the current depends besides parameters and speed: how long the motor has been
/// standing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Current {
    /// The time of the first poll in which the motor stood; `None` while it moves or is held.
    still_since: Option<Micros>,
}

impl Current {
    /// The excitation for this state of motion. `speed` is the actual speed, in the unit of parameter 182.
    pub(super) fn select(&mut self, now: Micros, state: MotionState, speed: i32, values: &Values) -> Excitation {
        let slow = speed.abs() < values.get(P::SmartEnergyThresholdSpeed);
        let run = CurrentScale::from_parameter(values.get(P::MaximumCurrent));
        let mut excitation = Excitation { scale: run, free: false, cool_step: !slow };
        if state != MotionState::Standing {
            self.still_since = None;
        }
        match state {
            MotionState::Standing => {
                let stood = now.since(*self.still_since.get_or_insert(now));
                if stood >= hundredths(values.get(P::PowerDownDelay)) {
                    excitation.scale = CurrentScale::from_parameter(values.get(P::StandbyCurrent));
                }
                let freewheeling = values.get(P::Freewheeling);
                excitation.free = freewheeling != 0 && stood >= hundredths(freewheeling);
            }
            MotionState::Held => {}
            MotionState::Changing | MotionState::Cruising => {
                let boost = if state == MotionState::Changing { values.get(P::BoostCurrent) } else { 0 };
                let slow_run = if slow { values.get(P::SmartEnergySlowRunCurrent) } else { 0 };
                if let Some(current) = [boost, slow_run].into_iter().find(|current| *current != 0) {
                    excitation.scale = CurrentScale::from_parameter(current);
                }
            }
        }
        excitation
    }
}

impl Current {
    /// True if the motor was seen to stand.
    pub(super) const fn stands(&self) -> bool {
        self.still_since.is_some()
    }

    /// The time before which the excitation of a motor stays as it is, if its state of motion does. The time is as seen
    /// after the turn at `turn`; a time that is over counts no more.
    pub(super) fn calm_until(&self, turn: Micros, values: &Values) -> Micros {
        let Some(since) = self.still_since else { return Micros(u64::MAX) };
        let ends = [P::PowerDownDelay, P::Freewheeling].map(|delay| since.after(hundredths(values.get(delay))));
        ends.into_iter().filter(|end| *end > turn).min().unwrap_or(Micros(u64::MAX))
    }
}

/// Converts a time in hundredths of a second, the unit of parameters 204 and 214.
fn hundredths(n: i32) -> Micros {
    Micros::from_millis(10 * u64::from(n.unsigned_abs()))
}
