//! The current of the motor: run, boost, slow run, standby or none (manual chapter 4, parameters 6, 7, 150,
//! 182, 183, 200, 204, 214).
//!
//! A moving motor has the boost current (200) while its speed changes, else the slow run current (183) below the speed
//! of parameter 182, else the run current (6). A value of 0 in 200 or 183 switches that current off, and the next one
//! in this order applies.
//!
//! A motor that a stop switch holds keeps the run current as long as parameter 150 is 0: neither the slow run
//! current (183), nor standby (214), nor freewheeling (204) applies, although the motor stands. With 150 at 1 that
//! motor is treated like any other that stands: standby and freewheeling come after their times.

use super::values::Values;
use crate::param::AxisParameter as P;
use crate::units::{CurrentScale, Micros};

/// How the motor moves, as far as its current depends on that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionState {
    /// The motor stands, or is held by a stop switch and parameter 150 says that this counts as standing.
    Standing,
    /// The motor is held by a stop switch and keeps its current.
    Held,
    /// The motor accelerates or brakes, or is about to make its first step.
    Changing,
    /// The motor turns at the speed that it was sent at.
    Cruising,
}

/// How the windings are driven: the part of the driver's configuration that follows the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Excitation {
    /// Current of the windings.
    pub scale: CurrentScale,
    /// The bridges are off, the motor is freewheeling.
    pub free: bool,
    /// coolStep may adapt the current: it may not below the speed of parameter 182.
    pub cool_step: bool,
}

/// Chooses the current; for that it keeps the time since when the motor stands.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Current {
    still_since: Option<Micros>,
}

impl Current {
    /// The excitation for this state of motion; `speed` in the unit of parameter 182.
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

/// A time in hundredths of a second, the unit of parameters 204 and 214.
fn hundredths(n: i32) -> Micros {
    Micros::from_millis(10 * u64::from(n.unsigned_abs()))
}
