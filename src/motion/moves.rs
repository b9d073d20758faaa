//! The motion commands of an axis: they send the motor somewhere or end its motion, and they end a reference search.
//! What the chips do not take of a command is told them again by each poll.

use super::Error;
use super::axis::Axis;
use super::current::MotionState;
use super::former::Former;
use super::hardware::{Goal, Hardware, Known, Mode};
use super::joined::Joined;
use super::orders::Untold;
use super::pace::Pace;
use super::stall::Measured;
use crate::param::AxisParameter as P;
use crate::units::Micros;

impl<H: Hardware> Joined<'_, H> {
    /// Brings the hardware to the values of the parameters after power-on or a restart: no motion, at a position in
    /// microsteps. The motion controller has been [started](Hardware::start) before.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram; the axis is then to be started again.
    pub fn start(&mut self, now: Micros, position: i32) -> Result<(), Error> {
        self.place(position, true)?;
        self.arm_null();
        self.refresh_excitation(now, MotionState::Standing)?;
        if !H::accepts(&self.values) {
            // Each divisor was accepted when it was set, but possibly together with another value of the other divisor.
            for divisor in [P::RampDivisor, P::PulseDivisor] {
                let default = self.table.row(divisor).map_or(0, |row| row.default);
                self.values.set(divisor, default);
            }
        }
        self.head(Goal::Position { target: position, soft: false })
    }

    /// Rotates at `speed` in velocity mode, right if positive (ROR, ROL, SAP 2), in the unit of parameter 2; 0 stops
    /// the motor along the ramp (MST).
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn rotate(&mut self, now: Micros, speed: i32) -> Result<(), Error> {
        self.rotate_at(now, speed, None)
    }

    /// As [`rotate`](Self::rotate), with an acceleration in place of parameter 5, for example for a quick stop. It
    /// holds until the next motion command.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn rotate_at(&mut self, now: Micros, speed: i32, acceleration: Option<i32>) -> Result<(), Error> {
        self.begin(speed != 0, Pace { acceleration, ..Pace::default() });
        self.search = None;
        self.orders.travelling = false;
        self.run_at(now, speed)
    }

    /// Moves to `target`, in microsteps (MVP, SAP 0); also while the motor moves. In soft mode the axis stays in soft
    /// mode.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn move_to(&mut self, now: Micros, target: i32) -> Result<(), Error> {
        self.move_at(now, target, Pace::default())
    }

    /// As [`move_to`](Self::move_to), at a pace in place of parameters 4 and 5, which holds until the next motion
    /// command.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn move_at(&mut self, now: Micros, target: i32, pace: Pace<H::Shape>) -> Result<(), Error> {
        self.begin(true, pace);
        self.search = None;
        self.travel_to(now, target)?;
        self.orders.travelling = true;
        Ok(())
    }

    /// Makes all ready for [`move_at`](Self::move_at) but the datagram that sets the motor going, which that sends then. A
    /// reference search ends.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn ready(&mut self, now: Micros, target: i32, pace: Pace<H::Shape>) -> Result<(), Error> {
        self.begin(true, pace);
        self.search = None;
        self.wake(now)?;
        self.on_course(|hardware, controller, course| hardware.ready(controller, target, course))
    }

    /// The positioning move that is under way goes on at another pace, of which its chips are told by so many datagrams as one
    /// piece of a turn has time for. True if there were any: then this is to be called again.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take the datagram.
    pub fn approach(&mut self, pace: Pace<H::Shape>) -> Result<bool, Error> {
        self.set_pace(pace);
        self.on_course(H::approach)
    }

    /// The positioning move that is under way goes on at another pace, of which its chips are told at once.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn repace(&mut self, pace: Pace<H::Shape>) -> Result<(), Error> {
        self.set_pace(pace);
        self.adjust()
    }

    /// Stops the motor along the ramp of its present pace, and lets its move count as one that has ended before its target.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn break_off(&mut self, now: Micros) -> Result<(), Error> {
        self.events.cut_short |= self.orders.travelling;
        self.rotate_at(now, 0, self.orders.pace.acceleration)
    }

    /// Makes the position of a motor that has been stopped its target, so that it does not go on when what has stopped it is
    /// over. In velocity mode it does not anyway.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn stay(&mut self) -> Result<(), Error> {
        let Known { mode, position, .. } = *self.hardware.known();
        if !mode.positions() {
            return Ok(());
        }
        self.head(Goal::Position { target: position, soft: mode == Mode::Soft })
    }

    /// Stops the motor at once, without a ramp, and ends its positioning move or reference search.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip has not taken all of it; then each poll tries the stop again.
    pub fn hard_stop(&mut self) -> Result<(), Error> {
        self.untold = Untold::Stop;
        self.followed.rests = false;
        self.orders.ended = None;
        self.measured = Measured::default();
        self.search = None;
        self.orders.travelling = false;
        self.on_course(H::stop)?;
        self.untold = Untold::Nothing;
        Ok(())
    }

    /// Ends a rotation at the stop switch before the motor, which stands there, or brakes: it does not turn again by
    /// itself when the switch opens. What the chip does not take of that the next poll tells it again.
    pub fn end_at_switch(&mut self) {
        let told = self.hardware.known().target_speed;
        if self.head(Goal::Speed(0)).is_err() {
            self.untold = self.untold.max(Untold::Course);
        }
        self.orders.ended = Some(told);
    }

    /// Has the axis be what it was when it [was noted](Axis::note), before a command that has been refused: the motor
    /// goes on to its former goal. The chips are told so now, and what they do not take, with each poll.
    #[inline(never)]
    pub fn recall(&mut self, former: &Former<H::Shape>) {
        former.restore(self);
        self.set_pace(self.orders.pace);
        // The next poll that gets so far gives the motor its former current.
        self.driving.forget();
        self.untold = self.untold.max(Untold::Course);
        // What fails now is done by the polls.
        let _ = self.catch_up();
    }

    /// Tells the chips what they have not taken before.
    pub(super) fn catch_up(&mut self) -> Result<(), Error> {
        match self.untold {
            Untold::Nothing => Ok(()),
            Untold::Course | Untold::Position => {
                let known = *self.hardware.known();
                if self.untold == Untold::Position {
                    self.place(known.position, true)?;
                }
                let ended = self.orders.ended;
                let told = self.resume(known);
                // That is no new goal.
                self.orders.ended = ended;
                self.untold = if told.is_ok() { Untold::Nothing } else { self.untold };
                told
            }
            Untold::Stop => self.hard_stop(),
        }
    }

    /// Rotates at a speed, for a command or for a leg of a reference search, which goes on.
    pub(super) fn run_at(&mut self, now: Micros, speed: i32) -> Result<(), Error> {
        if speed != 0 {
            self.wake(now)?;
        }
        self.head(Goal::Speed(speed))
    }

    /// Goes to a position, for a command or for the end of a reference search, which goes on.
    pub(super) fn travel_to(&mut self, now: Micros, target: i32) -> Result<(), Error> {
        self.wake(now)?;
        // A speed that was worked out for the motion is that of a trapezoidal ramp.
        let soft = self.hardware.known().mode == Mode::Soft && self.orders.pace.speed.is_none();
        self.head(Goal::Position { target, soft })
    }

    /// Changes the ramp mode (parameter 138). On a change to velocity mode the motor keeps the speed for which it was
    /// heading; on a change to a positioning mode it goes to the last target. A reference search ends, as if the motor
    /// had been stopped before.
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
                self.orders.travelling = true;
                self.head(goal)
            }
            (_, _) => self.head(goal),
        }
    }

    /// Overwrites the actual position (parameter 1), in microsteps. The target becomes equal to it, so that nothing
    /// moves; a motor that was positioning, or searching, is stopped along the ramp.
    pub(super) fn set_position(&mut self, now: Micros, value: i32) -> Result<(), Error> {
        let known = *self.hardware.known();
        let standing = self.at_target() && known.speed == 0;
        let rests = self.rests();
        let ends = known.mode != Mode::Velocity || self.search.is_some();
        if ends {
            self.search = None;
            self.orders.travelling = false;
            self.set_pace(Pace::default());
            self.run_at(now, 0)?;
        }
        if let Err(error) = self.place(value, rests) {
            // It is not known what position the chip has. A motor that moves does not go on to a target then.
            if rests {
                self.untold = Untold::Position;
            } else if ends {
                self.untold = Untold::Stop;
            }
            return Err(error);
        }
        if known.mode.positions() && standing {
            self.head(Goal::Position { target: value, soft: known.mode == Mode::Soft })
        } else {
            Ok(())
        }
    }

    /// Overwrites the actual position as a write to parameter 1 does, and with it the positions of the
    /// encoders.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn set_positions(&mut self, now: Micros, value: i32) -> Result<(), Error> {
        self.set_position(now, value)?;
        self.encoders.set(value);
        let (hardware, controller) = self.reach();
        hardware.place_encoder(controller, value)
    }

    /// Notes that a motion command begins: parameter 207 is cleared, and if the command `moves` the motor, an encoder
    /// deviation may stop the motor again.
    fn begin(&mut self, moves: bool, pace: Pace<H::Shape>) {
        self.set_pace(pace);
        self.orders.errors = 0;
        self.orders.deviating &= !moves;
    }

    pub(super) fn set_pace(&mut self, pace: Pace<H::Shape>) {
        self.hardware.reshape(pace.shape);
        self.orders.pace = pace;
    }

    /// Prepares the driver for a motion: it gets the current of a motor whose speed changes, so that this current flows
    /// from the first step on.
    fn wake(&mut self, now: Micros) -> Result<(), Error> {
        let (Axis { hardware, values, orders, driving, measured, .. }, controller) = self.parts();
        driving.release(hardware, controller, values, &mut orders.alarms, measured)?;
        self.refresh_excitation(now, MotionState::Changing)
    }

    /// Gives the motor a goal, on the course of parameters, pace and search.
    pub(super) fn head(&mut self, goal: Goal) -> Result<(), Error> {
        self.followed.rests = false;
        self.orders.ended = None;
        if let Goal::Position { target, .. } = goal {
            self.orders.was_at_target &= self.last_position() == target;
        }
        self.on_course(|hardware, controller, course| hardware.head(controller, goal, course))
    }

    /// Gives the motor the goal again that it had.
    #[inline(never)]
    pub(super) fn resume(&mut self, known: Known) -> Result<(), Error> {
        let Known { mode, target, target_speed, .. } = known;
        self.head(if mode.positions() {
            Goal::Position { target, soft: mode == Mode::Soft }
        } else {
            Goal::Speed(target_speed)
        })
    }

    /// Brings a motion that is under way to the course of the present parameters, pace and search.
    pub(super) fn adjust(&mut self) -> Result<(), Error> {
        self.on_course(H::adjust)
    }

    /// Makes both position and target `value`, in microsteps. The motor stands, or is in velocity mode: so nothing
    /// moves. A stallGuard2 measurement under way no longer counts, because its progress is told by the position.
    pub(super) fn place(&mut self, value: i32, standing: bool) -> Result<(), Error> {
        let (hardware, controller) = self.reach();
        hardware.place(controller, value, standing)?;
        self.measured = Measured::default();
        Ok(())
    }
}
