//! What loads the motor: the simulated world, the control port of a virtual module, or the user's hand.

use std::time::Duration;

use hal_sim::control::{Control, State};
use hal_sim::world::motor::{FULL_TORQUE, Motor};
use serde_json::{Map, Value};

use super::ask::Lines;
use super::drive::Drive;
use crate::failure::Failure;
use crate::world::Port;

/// The part of the torque in reserve that a virtual motor is loaded with.
const PART: f64 = 0.9;
/// The part of the torque at its current that a virtual motor is loaded with if its friction is not known.
const CAREFUL: f64 = 0.75;
/// Longest wait for an answer of a control port.
const PATIENCE: Duration = Duration::from_secs(5);

/// What loads the motor.
pub(super) enum Brake {
    /// The world of the module inside this program.
    World {
        /// The load that the user has named, as a fraction of the torque at full current.
        load: Option<f64>,
        /// The load that was there before.
        before: f64,
    },
    /// The control port of a virtual module.
    Control {
        /// The port.
        port: ControlPort,
        /// The load that the user has named.
        load: Option<f64>,
        /// The load that was there before.
        before: f64,
    },
    /// The user, who holds the shaft.
    Hand(Lines),
}

impl Brake {
    /// The control port at an address.
    pub(super) fn control(address: &str, axis: u8, load: Option<f64>) -> Result<Self, Failure> {
        let mut port = ControlPort(Port::connect(address, PATIENCE)?);
        let before = port.axis(usize::from(axis))?.get("load").and_then(Value::as_f64).unwrap_or_default();
        Ok(Brake::Control { port, load, before })
    }

    /// Loads the motor, which turns at constant speed with its whole current. Returns what it is loaded with, in words.
    pub(super) fn hold(&mut self, drive: &mut Drive<'_, '_>) -> Result<String, Failure> {
        while drive.look()?.is_none() {}
        let axis = usize::from(drive.bench.axis);
        let load = match self {
            Brake::World { load, before } => {
                *before = fraction(drive, |motor| motor.load());
                let reserve = fraction(drive, |motor| motor.available().saturating_sub(motor.demand()));
                let load = load.unwrap_or(bearable(*before, reserve));
                set_load(drive, axis, load)?;
                load
            }
            Brake::Control { port, load, .. } => {
                let state = port.axis(axis)?;
                let current = state.get("current").and_then(Value::as_f64).unwrap_or_default();
                let load = load.unwrap_or(careful(current));
                port.send(&format!("load {load:.4} {axis}"))?;
                load
            }
            Brake::Hand(lines) => {
                lines.say("Now brake the shaft while it turns, nearly as much as it can bear, and press Enter.");
                while !lines.confirmed()? {
                    drive.look()?;
                }
                return Ok("by hand".into());
            }
        };
        Ok(format!("load {load:.2}"))
    }

    /// Takes the load away.
    pub(super) fn release(&mut self, drive: &mut Drive<'_, '_>) -> Result<(), Failure> {
        let axis = usize::from(drive.bench.axis);
        match self {
            Brake::World { before, .. } => set_load(drive, axis, *before),
            Brake::Control { port, before, .. } => port.send(&format!("load {before} {axis}")).map(|_| ()),
            Brake::Hand(lines) => {
                lines.say("Now let go of the shaft, and press Enter.");
                while !lines.confirmed()? {
                    drive.look()?;
                }
                Ok(())
            }
        }
    }

    /// Full steps that the motor has lost so far, where that is known.
    pub(super) fn lost(&mut self, drive: &mut Drive<'_, '_>) -> Result<i64, Failure> {
        let axis = usize::from(drive.bench.axis);
        Ok(match self {
            Brake::World { .. } => {
                let module = drive.bench.module.simulated();
                let state = module.map(|module| State::of(&module.board().borrow()));
                state.and_then(|state| state.axes.get(axis).map(|axis| axis.lost_steps)).unwrap_or_default()
            }
            Brake::Control { port, .. } => {
                port.axis(axis)?.get("lost_steps").and_then(Value::as_i64).unwrap_or_default()
            }
            Brake::Hand(_) => 0,
        })
    }

    /// Takes the load away when all else is over, as far as that can be done without the motor.
    pub(super) fn let_go(&mut self, axis: u8) {
        if let Brake::Control { port, before, .. } = self {
            // A port that is gone has no module to load.
            let _ = port.send(&format!("load {before} {axis}"));
        }
    }
}

/// A load that a motor can just bear, which has one already and this torque in reserve.
fn bearable(before: f64, reserve: f64) -> f64 {
    before + reserve * PART
}

/// A load that most motors can bear with this current in 1/32 of the full one.
fn careful(current: f64) -> f64 {
    current / 32.0 * CAREFUL
}

/// A torque of the motor of the module inside this program, as a fraction of that at full current.
fn fraction(drive: &mut Drive<'_, '_>, torque: impl FnOnce(&Motor) -> u32) -> f64 {
    let axis = usize::from(drive.bench.axis);
    let Some(module) = drive.bench.module.simulated() else { return 0.0 };
    let board = module.board().borrow();
    f64::from(torque(board.world().axis(axis).motor())) / f64::from(FULL_TORQUE)
}

fn set_load(drive: &mut Drive<'_, '_>, axis: usize, load: f64) -> Result<(), Failure> {
    let Some(module) = drive.bench.module.simulated() else { return Ok(()) };
    Control::Load { axis, load }.apply(&mut module.board().borrow_mut()).map(|_| ()).map_err(Failure::Failed)
}

/// The control port of `tmcl sim`.
pub(super) struct ControlPort(Port);

impl ControlPort {
    /// Sends a command that has to be carried out, and returns the answer.
    fn send(&mut self, command: &str) -> Result<Map<String, Value>, Failure> {
        let (_, answer) = self.0.ask(command).map_err(|failure| Failure::Failed(format!("--control: {failure}")))?;
        match answer.get("error").and_then(Value::as_str) {
            Some(why) => Err(Failure::Failed(format!("--control: {command}: {why}"))),
            None => Ok(answer),
        }
    }

    /// The state of an axis.
    fn axis(&mut self, axis: usize) -> Result<Value, Failure> {
        let state = self.send("state")?;
        let found = state.get("axes").and_then(|axes| axes.get(axis)).cloned();
        found.ok_or_else(|| Failure::Failed(format!("--control: the module there has no axis {axis}")))
    }
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
