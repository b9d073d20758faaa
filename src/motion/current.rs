//! Which motor current applies: run, boost, slow, standby or none (manual chapter 4, parameters 6, 7, 150,
//! 182, 183, 200, 204, 214).
//!
//! A moving motor has the boost current (200) while its speed changes, else the slow run current (183) below the speed of
//! parameter 182, else the run current (6); a current of 0 in 200 or 183 is none, and the next one applies.
//!
//! A motor that an end switch holds stays at the run current as long as parameter 150 is 0: neither the slow run
//! current (183), nor standby (214), nor freewheeling (204) applies, although it stands. With 150 at 1 it stands
//! like any other: standby and freewheeling come after their times.

use crate::param::AxisParameter as P;
use crate::units::{CurrentScale, Internal, Micros};

/// What the motor does, as far as its current is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// Stands, or is held by an end switch that powers it down.
    Still,
    /// Is held by an end switch and keeps its current.
    Held,
    /// Accelerates or brakes, or is about to make its first step.
    Changing,
    /// Runs at its speed.
    Running,
}

/// What the driver is told beyond the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Drive {
    /// Current scale.
    pub scale: CurrentScale,
    /// Bridges off.
    pub free: bool,
    /// coolStep may work.
    pub cool_step: bool,
}

/// Chooses the current and keeps the standstill's time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Current {
    still_since: Option<Micros>,
}

impl Current {
    /// What applies now.
    pub(super) fn select(&mut self, now: Micros, phase: Phase, speed: Internal, value: impl Fn(P) -> i32) -> Drive {
        let slow = speed.abs() < value(P::SmartEnergyThresholdSpeed);
        let run = CurrentScale::from_parameter(value(P::MaximumCurrent));
        let mut drive = Drive { scale: run, free: false, cool_step: !slow };
        if phase != Phase::Still {
            self.still_since = None;
        }
        match phase {
            Phase::Still => {
                let stood = now.since(*self.still_since.get_or_insert(now));
                if stood >= ticks(value(P::PowerDownDelay)) {
                    drive.scale = CurrentScale::from_parameter(value(P::StandbyCurrent));
                }
                let freewheeling = value(P::Freewheeling);
                drive.free = freewheeling != 0 && stood >= ticks(freewheeling);
            }
            Phase::Held => {}
            Phase::Changing | Phase::Running => {
                let boost = if phase == Phase::Changing { value(P::BoostCurrent) } else { 0 };
                let slow_run = if slow { value(P::SmartEnergySlowRunCurrent) } else { 0 };
                if let Some(current) = [boost, slow_run].into_iter().find(|current| *current != 0) {
                    drive.scale = CurrentScale::from_parameter(current);
                }
            }
        }
        drive
    }
}

/// Parameters 204 and 214 count hundredths of a second.
fn ticks(n: i32) -> Micros {
    Micros::from_millis(10 * u64::from(n.unsigned_abs()))
}
