//! Where a motor is sent: the commands that move an axis, or end a move.

use super::Error;
use super::axis::{Joined, Pace};
use super::current::MotionState;
use super::hardware::{Goal, Hardware, Mode};
use super::stall::Measured;
use crate::param::AxisParameter as P;
use crate::units::Micros;

impl<H: Hardware> Joined<'_, H> {
    /// Brings the hardware to the parameters' values after power-on or a restart: position zero, no motion. Its
    /// controller has been [started](Hardware::start) before.
    pub fn start(&mut self, now: Micros) -> Result<(), Error> {
        self.place(0)?;
        self.arm_null();
        self.refresh_excitation(now, MotionState::Standing)?;
        if !H::accepts(&self.values) {
            // Each divisor was accepted once, but not with the other one it was stored with.
            for divisor in [P::RampDivisor, P::PulseDivisor] {
                let default = self.table.row(divisor).map_or(0, |row| row.default);
                self.values.set(divisor, default);
            }
        }
        self.head(Goal::Position { target: 0, soft: false })
    }

    /// Rotates at `speed` in velocity mode, right if positive (ROR, ROL, SAP 2); 0 stops along the ramp
    /// (MST).
    pub fn rotate(&mut self, now: Micros, speed: i32) -> Result<(), Error> {
        self.rotate_at(now, speed, None)
    }

    /// The same with an acceleration of its own, as for a quick stop, until the next motion command.
    pub fn rotate_at(&mut self, now: Micros, speed: i32, acceleration: Option<i32>) -> Result<(), Error> {
        self.begin(speed != 0, Pace { speed: None, acceleration });
        self.search = None;
        self.travelling = false;
        self.run_at(now, speed)
    }

    /// Moves to `target` (MVP, SAP 0), also while it moves. In soft mode it stays in soft mode.
    pub fn move_to(&mut self, now: Micros, target: i32) -> Result<(), Error> {
        self.move_at(now, target, Pace::default())
    }

    /// The same at a pace of its own, until the next motion command.
    pub fn move_at(&mut self, now: Micros, target: i32, pace: Pace) -> Result<(), Error> {
        self.begin(true, pace);
        self.search = None;
        self.travel_to(now, target)?;
        self.travelling = true;
        Ok(())
    }

    /// Rotates, for a command or a reference search.
    pub(super) fn run_at(&mut self, now: Micros, speed: i32) -> Result<(), Error> {
        if speed != 0 {
            self.wake(now)?;
        }
        self.head(Goal::Speed(speed))
    }

    /// Positions, for a command or a reference search.
    pub(super) fn travel_to(&mut self, now: Micros, target: i32) -> Result<(), Error> {
        self.wake(now)?;
        let soft = self.hardware.known().mode == Mode::Soft;
        self.head(Goal::Position { target, soft })
    }

    /// Changes the ramp mode (parameter 138). Into velocity mode the motor keeps the speed it was heading
    /// for; out of it, it goes to the last target. A reference search ends, as if the motor had been stopped before.
    pub(super) fn change_mode(&mut self, now: Micros, mode: Mode) -> Result<(), Error> {
        if self.search.is_some() {
            self.rotate(now, 0)?;
        }
        let target = self.hardware.known().target;
        let goal = Goal::Position { target, soft: mode == Mode::Soft };
        match (self.hardware.known().mode, mode) {
            (Mode::Velocity, Mode::Velocity) => Ok(()),
            (_, Mode::Velocity) => {
                let heading = self.target_speed()?;
                self.rotate(now, heading)
            }
            (Mode::Velocity, _) => {
                self.begin(true, Pace::default());
                self.wake(now)?;
                self.travelling = true;
                self.head(goal)
            }
            (_, _) => self.head(goal),
        }
    }

    /// Overwrites the position counter (parameter 1). Target and position become equal, so that nothing
    /// moves; a motor that was positioning, or searching, is stopped along the ramp.
    pub(super) fn set_position(&mut self, now: Micros, value: i32) -> Result<(), Error> {
        let known = *self.hardware.known();
        let standing = self.at_target() && known.speed == 0;
        if known.mode != Mode::Velocity || self.search.is_some() {
            self.search = None;
            self.travelling = false;
            self.run_at(now, 0)?;
        }
        self.place(value)?;
        if known.mode.positions() && standing {
            self.head(Goal::Position { target: value, soft: known.mode == Mode::Soft })
        } else {
            Ok(())
        }
    }

    /// A motion command begins: error flags are cleared, and if the command moves the motor, a deviation may stop it
    /// again.
    fn begin(&mut self, moves: bool, pace: Pace) {
        self.pace = pace;
        self.errors = 0;
        self.deviating &= !moves;
    }

    /// Before a motion: the driver gets the current of a motor whose speed changes, so that it is there with the first
    /// step.
    fn wake(&mut self, now: Micros) -> Result<(), Error> {
        self.release_driver()?;
        self.refresh_excitation(now, MotionState::Changing)
    }

    fn head(&mut self, goal: Goal) -> Result<(), Error> {
        if let Goal::Position { target, .. } = goal {
            self.was_at_target &= self.last_position() == target;
        }
        self.on_course(|hardware, controller, course| hardware.head(controller, goal, course))
    }

    /// The motor goes on as parameters and search want it now.
    pub(super) fn adjust(&mut self) -> Result<(), Error> {
        self.on_course(H::adjust)
    }

    /// Makes target and position `value`, in a mode in which that moves nothing.
    fn place(&mut self, value: i32) -> Result<(), Error> {
        let (hardware, controller) = self.reach();
        hardware.place(controller, value)?;
        self.measured = Measured::default();
        Ok(())
    }
}
