//! The motion commands of an axis: they send the motor somewhere or end its motion, and they end a reference search.
//! What the chips do not take of a command is told them again by each poll.

use super::Error;
use super::current::MotionState;
use super::former::Former;
use super::hardware::{Goal, Hardware, Known, RampGenerator, RampMode, Shape};
use super::joined::Joined;
use super::orders::Untold;
use super::pace::Pace;
use super::stall::Measured;
use crate::param::AxisParameter as P;
use crate::units::Micros;

impl<H: Hardware> Joined<'_, H> {
    /// Brings the hardware to the values of the parameters after power-on or a restart: no motion, at a position in
    /// microsteps. The motion controller has been [started](super::MotionController::start) before.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram; the axis is then to be started again.
    pub fn start(&mut self, now: Micros, position: i32) -> Result<(), Error> {
        self.set_position(position, true)?;
        self.axis.arm_null();
        self.refresh_excitation(now, MotionState::Standing)?;
        if !H::Shape::accepts(&self.axis.values) {
            // Each divisor was accepted when it was set, but possibly together with another value of the other divisor.
            for divisor in [P::RampDivisor, P::PulseDivisor] {
                let default = self.axis.table.row(divisor).map_or(0, |row| row.default);
                self.axis.values.set(divisor, default);
            }
        }
        self.go(Goal::Position { target: position, soft: false })
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
        self.axis.search = None;
        self.axis.orders.travelling = false;
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
        self.axis.search = None;
        self.travel_to(now, target)?;
        self.axis.orders.travelling = true;
        Ok(())
    }

    /// Makes all ready for [`move_at`](Self::move_at) but the datagram that sets the motor going, which that sends
    /// then. A reference search ends.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn prepare(&mut self, now: Micros, target: i32, pace: Pace<H::Shape>) -> Result<(), Error> {
        self.begin(true, pace);
        self.axis.search = None;
        self.wake(now)?;
        let (mut chips, profile) = self.chips_and_profile();
        chips.prepare(target, &profile)
    }

    /// Has the positioning move that is under way go on at another pace. Its chips are told of it by so many datagrams
    /// as one piece of a turn has time for. True if there were any: then this is to be called again.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take the datagram.
    pub fn ease(&mut self, pace: Pace<H::Shape>) -> Result<bool, Error> {
        self.set_pace(pace);
        let (mut chips, profile) = self.chips_and_profile();
        chips.ease(&profile)
    }

    /// The positioning move that is under way goes on at another pace, of which its chips are told at once.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn repace(&mut self, pace: Pace<H::Shape>) -> Result<(), Error> {
        self.set_pace(pace);
        self.retune()
    }

    /// Stops the motor along the ramp of its present pace, and lets its move count as one that has ended before its
    /// target.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn break_off(&mut self, now: Micros) -> Result<(), Error> {
        self.axis.events.cut_short |= self.axis.orders.travelling;
        self.rotate_at(now, 0, self.axis.orders.pace.acceleration)
    }

    /// Makes the position of a motor that has been stopped its target, so that it does not go on when what has stopped
    /// it is over. In velocity mode it does not anyway.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn stay(&mut self) -> Result<(), Error> {
        let Known { mode, position, .. } = *self.axis.hardware.known();
        if !mode.positions() {
            return Ok(());
        }
        self.go(Goal::Position { target: position, soft: mode == RampMode::Soft })
    }

    /// Stops the motor at once, without a ramp, and ends its positioning move or reference search.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip has not taken all of it; then each poll tries the stop again.
    pub fn hard_stop(&mut self) -> Result<(), Error> {
        self.axis.untold = Untold::Stop;
        self.axis.followed.rests = false;
        self.axis.orders.ended = None;
        self.axis.measured = Measured::default();
        self.axis.search = None;
        self.axis.orders.travelling = false;
        self.stop()?;
        self.axis.untold = Untold::Nothing;
        Ok(())
    }

    /// Ends a rotation at the stop switch before the motor, which stands there, or brakes: it does not turn again by
    /// itself when the switch opens. What the chip does not take of that the next poll tells it again.
    pub fn end_at_switch(&mut self) {
        let told = self.axis.hardware.known().target_speed;
        if self.go(Goal::Speed(0)).is_err() {
            self.axis.untold = self.axis.untold.max(Untold::Goal);
        }
        self.axis.orders.ended = Some(told);
    }

    /// Has the axis be what it was when it [was noted](super::Axis::note), before a command that has been refused: the
    /// motor goes on to its former goal. The chips are told so now, and what they do not take, with each poll.
    #[inline(never)]
    pub fn recall(&mut self, former: &Former<H::Shape>) {
        former.restore(self.axis);
        self.set_pace(self.axis.orders.pace);
        // The next poll that gets so far gives the motor its former current.
        self.axis.driving.forget();
        self.axis.untold = self.axis.untold.max(Untold::Goal);
        // What fails now is done by the polls.
        let _ = self.catch_up();
    }

    /// Tells the chips what they have not taken before.
    pub(super) fn catch_up(&mut self) -> Result<(), Error> {
        match self.axis.untold {
            Untold::Nothing => Ok(()),
            Untold::Goal | Untold::Position => {
                let known = *self.axis.hardware.known();
                if self.axis.untold == Untold::Position {
                    self.set_position(known.position, true)?;
                }
                let ended = self.axis.orders.ended;
                let told = self.resume(known);
                // That is no new goal.
                self.axis.orders.ended = ended;
                self.axis.untold = if told.is_ok() { Untold::Nothing } else { self.axis.untold };
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
        self.go(Goal::Speed(speed))
    }

    /// Goes to a position, for a command or for the end of a reference search, which goes on.
    pub(super) fn travel_to(&mut self, now: Micros, target: i32) -> Result<(), Error> {
        self.wake(now)?;
        // A speed that was worked out for the motion is that of a trapezoidal ramp.
        let soft = self.axis.hardware.known().mode == RampMode::Soft && self.axis.orders.pace.speed.is_none();
        self.go(Goal::Position { target, soft })
    }

    /// Changes the ramp mode (parameter 138). On a change to velocity mode the motor keeps the speed for which it was
    /// heading; on a change to a positioning mode it goes to the last target. A reference search ends, as if the motor
    /// had been stopped before.
    pub(super) fn change_mode(&mut self, now: Micros, mode: RampMode) -> Result<(), Error> {
        if self.axis.search.is_some() {
            self.rotate(now, 0)?;
        }
        let target = self.axis.hardware.known().target;
        let goal = Goal::Position { target, soft: mode == RampMode::Soft };
        match (self.axis.hardware.known().mode, mode) {
            (RampMode::Velocity, RampMode::Velocity) => Ok(()),
            (_, RampMode::Velocity) => {
                let heading = self.target_speed()?;
                self.rotate(now, heading)
            }
            (RampMode::Velocity, _) => {
                self.begin(true, Pace::default());
                self.wake(now)?;
                self.axis.orders.travelling = true;
                self.go(goal)
            }
            (_, _) => self.go(goal),
        }
    }

    /// Overwrites the actual position (parameter 1), in microsteps. The target becomes equal to it, so that nothing
    /// moves; a motor that was positioning, or searching, is stopped along the ramp.
    pub(super) fn overwrite_position(&mut self, now: Micros, value: i32) -> Result<(), Error> {
        let known = *self.axis.hardware.known();
        let standing = self.axis.at_target() && known.speed == 0;
        let rests = self.axis.rests();
        let ends = known.mode != RampMode::Velocity || self.axis.search.is_some();
        if ends {
            self.axis.search = None;
            self.axis.orders.travelling = false;
            self.set_pace(Pace::default());
            self.run_at(now, 0)?;
        }
        if let Err(error) = self.set_position(value, rests) {
            // It is not known what position the chip has. A motor that moves does not go on to a target then.
            if rests {
                self.axis.untold = Untold::Position;
            } else if ends {
                self.axis.untold = Untold::Stop;
            }
            return Err(error);
        }
        if known.mode.positions() && standing {
            self.go(Goal::Position { target: value, soft: known.mode == RampMode::Soft })
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
        self.overwrite_position(now, value)?;
        self.axis.encoders.set(value);
        self.chips().set_encoder(value)
    }

    /// Notes that a motion command begins: parameter 207 is cleared, and if the command `moves` the motor, an encoder
    /// deviation may stop the motor again.
    fn begin(&mut self, moves: bool, pace: Pace<H::Shape>) {
        self.set_pace(pace);
        self.axis.orders.errors = 0;
        self.axis.orders.deviating &= !moves;
    }

    pub(super) fn set_pace(&mut self, pace: Pace<H::Shape>) {
        self.chips().reshape(pace.shape);
        self.axis.orders.pace = pace;
    }

    /// Prepares the driver for a motion: it gets the current of a motor whose speed changes, so that this current flows
    /// from the first step on.
    fn wake(&mut self, now: Micros) -> Result<(), Error> {
        self.release_driver()?;
        self.refresh_excitation(now, MotionState::Changing)
    }

    /// Gives the motor a goal, with the profile of parameters, pace and search.
    pub(super) fn go(&mut self, goal: Goal) -> Result<(), Error> {
        self.axis.followed.rests = false;
        self.axis.orders.ended = None;
        if let Goal::Position { target, .. } = goal {
            self.axis.orders.was_at_target &= self.axis.last_position() == target;
        }
        let (mut chips, profile) = self.chips_and_profile();
        chips.go(goal, &profile)
    }

    /// Gives the motor the goal again that it had.
    #[inline(never)]
    pub(super) fn resume(&mut self, known: Known) -> Result<(), Error> {
        let Known { mode, target, target_speed, .. } = known;
        self.go(if mode.positions() {
            Goal::Position { target, soft: mode == RampMode::Soft }
        } else {
            Goal::Speed(target_speed)
        })
    }

    /// Stops the motor at once, whatever the axis wants of it.
    pub(super) fn stop(&mut self) -> Result<(), Error> {
        let (mut chips, profile) = self.chips_and_profile();
        chips.stop(&profile)
    }

    /// Brings a motion that is under way to the profile of the present parameters, pace and search.
    pub(super) fn retune(&mut self) -> Result<(), Error> {
        let (mut chips, profile) = self.chips_and_profile();
        chips.retune(&profile)
    }

    /// Makes both position and target `value`, in microsteps. The motor stands, or is in velocity mode: so nothing
    /// moves. A stallGuard2 measurement under way no longer counts, because its progress is told by the position.
    pub(super) fn set_position(&mut self, value: i32, standing: bool) -> Result<(), Error> {
        self.chips().set_position(value, standing)?;
        self.axis.measured = Measured::default();
        Ok(())
    }
}
