//! The measurement under way: the motor on its track, what loads it, and how far it has come.

use super::brake::Brake;
use super::drive::Drive;
use super::plan::Cruise;
use super::stats::Reading;
use super::watch::Method;
use crate::failure::Failure;
use crate::progress::Progress;

/// The measurement under way.
pub(super) struct Measurement<'b, 'a> {
    /// The motor.
    pub(super) drive: Drive<'b, 'a>,
    /// The speeds at which it is measured.
    pub(super) cruises: Vec<Cruise>,
    /// The brake that loads the motor.
    brake: &'b mut dyn Brake,
    progress: &'b mut dyn FnMut(Progress<'_>),
    /// The job that is under way, and how many readings it takes.
    what: String,
    total: usize,
    done: usize,
    /// The load of the motor, in words, and the full steps that the motor had lost before.
    load: Option<(String, i64)>,
}

impl<'b, 'a> Measurement<'b, 'a> {
    /// A measurement of `what` that is going to begin, and takes about so many readings.
    pub(super) fn new(
        drive: Drive<'b, 'a>,
        cruises: Vec<Cruise>,
        brake: &'b mut dyn Brake,
        progress: &'b mut dyn FnMut(Progress<'_>),
        what: &str,
        total: usize,
    ) -> Self {
        let what = format!("measuring {what}");
        progress(Progress { what: &what, done: 0, total });
        Measurement { drive, cruises, brake, progress, what, total, done: 0, load: None }
    }

    /// From now on the motor is measured at this speed.
    pub(super) fn begin(&mut self, cruise: &Cruise) -> Result<(), Failure> {
        self.drive.cruise(cruise.speed, cruise.full_step)
    }

    /// A reading at this speed.
    pub(super) fn read(&mut self, method: Method) -> Result<Reading, Failure> {
        let reading = self.drive.measure(method)?;
        self.done += 1;
        (self.progress)(Progress { what: &self.what, done: self.done, total: self.total });
        Ok(reading)
    }

    /// The load of the motor, in words.
    pub(super) fn load(&self) -> &str {
        self.load.as_ref().map_or("", |(load, _)| load)
    }

    /// Loads the motor.
    pub(super) fn hold(&mut self) -> Result<(), Failure> {
        let lost = self.brake.lost(&mut self.drive)?;
        while self.drive.look()?.is_none() {}
        self.load = Some((self.brake.hold(&mut self.drive)?, lost));
        Ok(())
    }

    /// Takes the load away.
    pub(super) fn release(&mut self) -> Result<(), Failure> {
        self.brake.release(&mut self.drive)?;
        let lost = self.brake.lost(&mut self.drive)?;
        match &self.load {
            Some((load, before)) => bore(load, *before, lost).map_err(Failure::Failed),
            None => Ok(()),
        }
    }
}

/// Whether the motor has borne a load: not if it has lost more full steps now than before.
fn bore(load: &str, before: i64, now: i64) -> Result<(), String> {
    match now - before {
        0 => Ok(()),
        steps => Err(format!("the motor lost {steps} full steps under {load}: give it less with --load")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Full steps that a motor has lost before the measurement do not count.
    #[test]
    fn only_steps_that_are_lost_under_the_load_count() {
        assert_eq!((bore("load 0.50", 0, 0), bore("load 0.50", 12, 12)), (Ok(()), Ok(())));
        let why = bore("load 0.50", 12, 16).unwrap_err();
        assert_eq!(why, "the motor lost 4 full steps under load 0.50: give it less with --load");
        assert!(bore("by hand", 12, 8).is_err());
    }
}
