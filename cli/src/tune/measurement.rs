//! The measurement under way: the motor on its track, what loads it, and how far it has come.

use super::brake::Brake;
use super::drive::{Drive, Method};
use super::plan::Cruise;
use super::stats::Reading;
use crate::failure::Failure;
use crate::progress::Progress;

/// The measurement under way.
pub(super) struct Measurement<'b, 'a> {
    /// The motor.
    pub(super) drive: Drive<'b, 'a>,
    /// The speeds at which it is measured.
    pub(super) cruises: Vec<Cruise>,
    /// What loads it.
    brake: Brake,
    progress: Progress,
    done: usize,
    /// What the motor was loaded with, in words, and the full steps that it had lost before.
    load: Option<(String, i64)>,
}

impl<'b, 'a> Measurement<'b, 'a> {
    /// A measurement that is going to begin. Its progress is `progress`, of so many readings.
    pub(super) fn new(drive: Drive<'b, 'a>, cruises: Vec<Cruise>, brake: Brake, progress: Progress) -> Self {
        Measurement { drive, cruises, brake, progress, done: 0, load: None }
    }

    /// From now on the motor is measured at this speed.
    pub(super) fn begin(&mut self, cruise: &Cruise) -> Result<(), Failure> {
        self.drive.cruise(cruise.speed, cruise.full_step)
    }

    /// A reading at this speed.
    pub(super) fn read(&mut self, method: Method) -> Result<Reading, Failure> {
        let reading = self.drive.measure(method)?;
        self.done += 1;
        self.progress.reach(self.done);
        Ok(reading)
    }

    /// The measurement is over: what loads the motor is handed back, and what it was loaded with, in words.
    pub(super) fn end(self) -> (Brake, String) {
        (self.brake, self.load.map_or_else(String::new, |(load, _)| load))
    }

    /// Loads the motor.
    pub(super) fn hold(&mut self) -> Result<(), Failure> {
        self.progress.pause();
        let lost = self.brake.lost(&mut self.drive)?;
        self.load = Some((self.brake.hold(&mut self.drive)?, lost));
        self.drive.refresh();
        Ok(())
    }

    /// Takes the load away.
    pub(super) fn release(&mut self) -> Result<(), Failure> {
        self.progress.pause();
        self.brake.release(&mut self.drive)?;
        self.drive.refresh();
        let lost = self.brake.lost(&mut self.drive)?;
        match &self.load {
            Some((load, before)) if lost != *before => {
                let steps = lost - before;
                Err(Failure::Failed(format!(
                    "the motor lost {steps} full steps under {load}: give it less with --load"
                )))
            }
            _ => Ok(()),
        }
    }
}
