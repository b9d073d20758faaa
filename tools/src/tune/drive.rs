//! The motor going to and fro on its track, and samples of it where its speed is constant.

use std::time::Duration;

use tmcm::param::AxisParameter as P;

use super::bench::Bench;
use super::stats::Reading;
use super::track::Track;
use super::watch::{Method, Seen, Watch};
use crate::failure::Failure;

/// Number of samples of which a reading is made.
pub(super) const SAMPLES: u32 = 12;
/// Time between two looks at a motor whose speed changes.
const LOOK: Duration = Duration::from_millis(5);

/// The motor on its track.
pub struct Drive<'b, 'a> {
    /// The axis.
    pub(super) bench: &'b mut Bench<'a>,
    watch: Watch,
}

impl<'b, 'a> Drive<'b, 'a> {
    /// A motor that stands at the home of its track. A full step has so many microsteps.
    pub(super) fn new(bench: &'b mut Bench<'a>, track: Track, full_step: i32) -> Self {
        Drive { bench, watch: Watch::new(track, full_step) }
    }

    /// From now on the motor goes at this speed, of which a full step takes so long.
    pub(super) fn cruise(&mut self, speed: i32, full_step_time: Duration) -> Result<(), Failure> {
        self.bench.set(P::MaximumSpeed, speed)?;
        self.watch.cruise(speed, full_step_time);
        Ok(())
    }

    /// The number of the axis.
    pub fn axis(&self) -> usize {
        self.bench.axis.into()
    }

    /// Looks at the motor once, and turns it round at the ends of its track. Returns its position if its speed is
    /// constant.
    ///
    /// # Errors
    /// The module does not answer, it has been asked to end, or the motor does not get on.
    pub fn look(&mut self) -> Result<Option<i32>, Failure> {
        let speed = self.bench.get(P::ActualSpeed)?;
        let position = self.bench.get(P::ActualPosition)?;
        match self.watch.see(speed, position) {
            Seen::Constant => return Ok(Some(position)),
            Seen::Changing => {}
            Seen::Idle(target) => self.bench.go_to(target)?,
            Seen::HeldUp(target) => {
                return Err(Failure::Failed(format!(
                    "the motor stopped at {position} on its way to {target}: a stop switch, a driver error, or too high a \
                     load; give it other room with --room"
                )));
            }
        }
        self.bench.pass(LOOK)?;
        Ok(None)
    }

    /// A reading at constant speed, with the settings of now.
    pub(super) fn measure(&mut self, method: Method) -> Result<Reading, Failure> {
        let mut reading = Reading::default();
        self.watch.begin();
        while reading.count() < SAMPLES {
            let Some(position) = self.look()? else {
                if self.watch.is_futile() {
                    return Err(Failure::Failed(
                        "the motor is not long enough at constant speed; give it more room with --room, or measure at a \
                         lower speed"
                            .into(),
                    ));
                }
                continue;
            };
            if let Some(time) = self.watch.wait(position, method) {
                self.bench.pass(time)?;
                continue;
            }
            let (load, current) = (self.bench.get(P::ActualLoad)?, self.bench.get(P::SmartEnergyActualCurrent)?);
            // Only what was read between two looks at a constant speed was measured at that speed.
            if self.look()?.is_some() {
                reading.take(load, current);
                self.watch.sampled(position);
            }
        }
        Ok(reading)
    }
}
