//! The motor going to and fro on its track, and samples of it where its speed is constant.

use std::time::Duration;

use tmcm::param::AxisParameter as P;

use super::bench::Bench;
use super::stats::Reading;
use super::track::Track;
use crate::failure::Failure;

/// Number of samples of which a reading is made.
pub(super) const SAMPLES: u32 = 12;
/// Full steps at constant speed after which a measurement has been made wholly with the settings of now: two measurements
/// with the filter, of which one has begun and ended.
pub(super) const FRESH: i32 = 8;
/// Number of times the motor may go along its track without a sample.
const PATIENCE: u32 = 20;
/// Number of looks after which a motor that should turn is taken for one that is held up.
const HELD_UP: u32 = 100;
/// Time between two looks at a motor whose speed changes.
const LOOK: Duration = Duration::from_millis(5);

/// How a reading is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Method {
    /// Full steps at constant speed before the first sample.
    pub(super) settle: i32,
    /// Full steps between two samples: those of one measurement.
    pub(super) apart: i32,
}

/// The motor on its track.
pub(super) struct Drive<'b, 'a> {
    /// The axis.
    pub(super) bench: &'b mut Bench<'a>,
    track: Track,
    /// Microsteps of a full step.
    full_step: i32,
    /// The speed that it is to have, as a number of its parameters; 0 before the first.
    speed: i32,
    /// The time of a full step at this speed.
    full_step_time: Duration,
    /// Where the motor is sent to.
    target: Option<i32>,
    /// Where it was first seen at constant speed, on this way and with these settings.
    since: Option<i32>,
    /// Number of looks at which it stood before its target.
    stood: u32,
    /// Number of ways without a sample.
    idle: u32,
}

impl<'b, 'a> Drive<'b, 'a> {
    /// A motor that stands at the home of its track. A full step has so many microsteps.
    pub(super) fn new(bench: &'b mut Bench<'a>, track: Track, full_step: i32) -> Self {
        Drive {
            bench,
            track,
            full_step,
            speed: 0,
            full_step_time: Duration::ZERO,
            target: None,
            since: None,
            stood: 0,
            idle: 0,
        }
    }

    /// From now on the motor goes at this speed, of which a full step takes so long.
    pub(super) fn cruise(&mut self, speed: i32, full_step_time: Duration) -> Result<(), Failure> {
        self.bench.set(P::MaximumSpeed, speed)?;
        (self.speed, self.full_step_time) = (speed, full_step_time);
        self.since = None;
        Ok(())
    }

    /// Changes a setting; what has been measured with the old one no longer counts.
    pub(super) fn set(&mut self, parameter: P, value: i32) -> Result<(), Failure> {
        self.bench.set(parameter, value)?;
        self.since = None;
        Ok(())
    }

    /// What was measured before no longer counts.
    pub(super) fn refresh(&mut self) {
        self.since = None;
    }

    /// Looks at the motor once, and turns it round at the ends of its track. Returns its position if its speed is constant.
    pub(super) fn look(&mut self) -> Result<Option<i32>, Failure> {
        let speed = self.bench.get(P::ActualSpeed)?;
        let position = self.bench.get(P::ActualPosition)?;
        if self.is_constant(speed) {
            self.stood = 0;
            self.since.get_or_insert(position);
            return Ok(Some(position));
        }
        self.since = None;
        if speed != 0 {
            self.stood = 0;
        } else if self.target.is_none_or(|target| target == position) {
            let target = self.track.farther(position);
            self.bench.go_to(target)?;
            self.target = Some(target);
            self.idle += 1;
        } else {
            self.stood += 1;
            if self.stood > HELD_UP {
                let target = self.target.unwrap_or_default();
                return Err(Failure::Failed(format!(
                    "the motor stopped at {position} on its way to {target}: a stop switch, a driver error, or too high a \
                     load; give it other room with --room"
                )));
            }
        }
        self.bench.pass(LOOK)?;
        Ok(None)
    }

    /// A reading at constant speed.
    pub(super) fn measure(&mut self, method: Method) -> Result<Reading, Failure> {
        let mut reading = Reading::default();
        let mut taken = 0;
        let mut last: Option<i32> = None;
        self.idle = 0;
        while taken < SAMPLES {
            let Some(position) = self.look()? else {
                last = None;
                if self.idle > PATIENCE {
                    return Err(Failure::Failed(
                        "the motor is not long enough at constant speed; give it more room with --room, or measure at a \
                         lower speed"
                            .into(),
                    ));
                }
                continue;
            };
            let (from, wanted) = match last {
                Some(last) => (last, method.apart),
                None => (self.since.unwrap_or(position), method.settle),
            };
            let missing = i64::from(wanted) * i64::from(self.full_step) - i64::from(position.abs_diff(from));
            if missing > 0 {
                self.wait(missing)?;
                continue;
            }
            let (load, current) = (self.bench.get(P::ActualLoad)?, self.bench.get(P::SmartEnergyActualCurrent)?);
            // Only what was read between two looks at a constant speed was measured at that speed.
            if self.look()?.is_some() {
                reading.load.take(load);
                reading.current.take(current);
                taken += 1;
                last = Some(position);
                self.idle = 0;
            }
        }
        Ok(reading)
    }

    /// Waits as long as the motor takes for so many microsteps, but not past the end of its way.
    fn wait(&mut self, microsteps: i64) -> Result<(), Failure> {
        let full_steps = microsteps as f64 / f64::from(self.full_step.max(1));
        let time = self.full_step_time.mul_f64(full_steps);
        self.bench.pass(time.clamp(Duration::from_millis(1), Duration::from_millis(50)))
    }

    fn is_constant(&self, speed: i32) -> bool {
        // A TMC5160 has the nearest speed that its units can express.
        let off = speed.unsigned_abs().abs_diff(self.speed.unsigned_abs());
        speed != 0 && off <= (self.speed.unsigned_abs() / 500).max(if self.speed > 2047 { 2 } else { 0 })
    }
}
