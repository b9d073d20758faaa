//! The brake that loads the motor, and the one that does so in a virtual world.

use hal_sim::control::{Control, State};
use hal_sim::world::motor::{FULL_TORQUE, Motor};

use super::drive::Drive;
use crate::failure::Failure;

/// The part of the torque in reserve that a virtual motor is loaded with.
const PART: f64 = 0.9;
/// The part of the torque at its current that a virtual motor is loaded with if its friction is not known.
const CAREFUL: f64 = 0.75;

/// A brake, which loads the motor. Whoever waits in it for something goes on to [look](Drive::look) at the motor, which
/// turns round at the ends of its track only so.
pub trait Brake {
    /// Loads the motor, which turns at constant speed with its whole current. Returns what it is loaded with, in words.
    ///
    /// # Errors
    /// The motor cannot be loaded.
    fn hold(&mut self, drive: &mut Drive<'_, '_>) -> Result<String, Failure>;

    /// Takes the load away.
    ///
    /// # Errors
    /// That cannot be done.
    fn release(&mut self, drive: &mut Drive<'_, '_>) -> Result<(), Failure>;

    /// Full steps that the motor has lost so far; 0 where that is not known.
    ///
    /// # Errors
    /// What should know it does not answer.
    fn lost(&mut self, drive: &mut Drive<'_, '_>) -> Result<i64, Failure>;

    /// Takes the load away when the measurement has failed, as far as that can be done without the motor.
    fn let_go(&mut self) {}
}

/// The world of a virtual module within this program.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct World {
    /// The load that the user has named, as a fraction of the torque at full current.
    load: Option<f64>,
    /// The load that was there before.
    before: f64,
}

impl World {
    /// Loads the motor so, as a fraction of the torque at full current, or else with what it can just bear.
    pub fn new(load: Option<f64>) -> Self {
        World { load, before: 0.0 }
    }
}

impl Brake for World {
    fn hold(&mut self, drive: &mut Drive<'_, '_>) -> Result<String, Failure> {
        self.before = fraction(drive, |motor| motor.load());
        let reserve = fraction(drive, |motor| motor.available().saturating_sub(motor.demand()));
        let load = self.load.unwrap_or(bearable(self.before, reserve));
        set_load(drive, load)?;
        Ok(in_words(load))
    }

    fn release(&mut self, drive: &mut Drive<'_, '_>) -> Result<(), Failure> {
        set_load(drive, self.before)
    }

    fn lost(&mut self, drive: &mut Drive<'_, '_>) -> Result<i64, Failure> {
        let axis = drive.axis();
        let state = drive.bench.module.simulated().map(|module| State::of(&module.board().borrow()));
        Ok(state.and_then(|state| state.axes.get(axis).map(|axis| axis.lost_steps)).unwrap_or_default())
    }
}

/// A load, as a fraction of the torque at full current, in words.
pub fn in_words(load: f64) -> String {
    format!("load {load:.2}")
}

/// A load that a motor can just bear, which has one already and this torque in reserve.
fn bearable(before: f64, reserve: f64) -> f64 {
    before + reserve * PART
}

/// A load that most motors can bear with this current in 1/32 of the full one, where nothing else is known of them.
pub fn careful(current: f64) -> f64 {
    current / 32.0 * CAREFUL
}

/// A torque of the motor of the module inside this program, as a fraction of that at full current.
fn fraction(drive: &mut Drive<'_, '_>, torque: impl FnOnce(&Motor) -> u32) -> f64 {
    let axis = drive.axis();
    let Some(module) = drive.bench.module.simulated() else { return 0.0 };
    let board = module.board().borrow();
    f64::from(torque(board.world().axis(axis).motor())) / f64::from(FULL_TORQUE)
}

fn set_load(drive: &mut Drive<'_, '_>, load: f64) -> Result<(), Failure> {
    let axis = drive.axis();
    let Some(module) = drive.bench.module.simulated() else { return Ok(()) };
    Control::Load { axis, load }.apply(&mut module.board().borrow_mut()).map(|_| ()).map_err(Failure::Failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nine tenths of what is in reserve come to what is there; of a current of 16/32 alone three quarters are borne.
    #[test]
    fn a_load_is_near_what_the_motor_bears() {
        assert_eq!(bearable(0.125, 0.25), 0.125 + 0.225);
        assert_eq!((careful(16.0), careful(32.0)), (0.375, 0.75));
    }
}
