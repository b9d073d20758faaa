//! A motor that moves while a key is held.

use std::time::Duration;

use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode, Status};

use super::fuel::{Axle, LONGEST_ROUND, fuel};
use super::owed::Owed;
use super::state::{JogEnd, Left, State};
use crate::conversation::{Conversation, Error};
use crate::stop::Stop;

/// So many keys one after the other whose replies take too long end a jog.
const MOST_LATE: u32 = 5;
/// Analog input that tells the supply voltage in tenths of volts, and the bank of the analog inputs.
const SUPPLY: (u8, u8) = (8, 1);

/// The meaning of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// To stop.
    Stop,
    /// To end the jog.
    Other,
}

/// The outcome of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// The motor is told where to go; where it was when it was told.
    Moving(State),
    /// Nothing that has to be shown.
    Done,
    /// The jog is over.
    Over(JogEnd),
}

/// A jog that goes on. It has to be [ended](Jog::end).
pub struct Jog<'a> {
    module: &'a mut Conversation,
    axle: Axle,
    /// How many keys one after the other were too late.
    late: u32,
    /// The time that a round trip has taken with the last key.
    round: Duration,
}

impl<'a> Jog<'a> {
    /// A jog of an axis, if it may be moved so: else what is wrong. Without a speed it is that of positioning. Nothing
    /// moves and nothing changes yet.
    ///
    /// # Errors
    /// The module does not answer.
    pub fn prepare(module: &'a mut Conversation, axis: u8, speed: Option<i32>) -> Result<Result<Self, State>, Error> {
        if let Some(message) = module.no_such_axis(axis)? {
            return Ok(Err(State::Wrong { message }));
        }
        let axle = Axle::read(module, axis, speed)?;
        if axle.speed < 1 {
            return Ok(Err(State::Wrong {
                message: format!(
                    "axis {axis} cannot be moved by keys: it slows down so gently that it would not stop in time, whatever \
                     its speed; give it a higher deceleration"
                ),
            }));
        }
        Ok(Ok(Jog { module, axle, late: 0, round: Duration::ZERO }))
    }

    /// The jog waits for keys.
    pub fn ready(&self) -> State {
        let Axle { axis, speed, wanted, unit, .. } = self.axle;
        State::JogReady { axis, speed, wanted: (speed < wanted).then_some(wanted), unit }
    }

    /// Stops a motor that somebody else has set in motion, because the motor moves while a key is held, and only then.
    /// Gives the axis the speed of the jog for positioning.
    ///
    /// # Errors
    /// The module does not answer, or refuses that.
    pub fn begin(&mut self) -> Result<(), Error> {
        if self.position_and_speed()?.1 != 0 {
            self.stop()?;
        }
        self.write_speed(self.axle.speed)
    }

    /// Lets time pass for a module whose time passes only so.
    pub fn pass(&mut self, time: Duration, stop: &dyn Stop) {
        if self.module.simulated().is_some() {
            self.module.pause(time, stop);
        }
    }

    /// Where the axis is, and its speed.
    ///
    /// # Errors
    /// The module does not answer.
    pub fn look(&mut self) -> Result<State, Error> {
        let (position, speed) = self.position_and_speed()?;
        Ok(self.at(position, speed))
    }

    /// Does what a key asks for that has just come.
    ///
    /// # Errors
    /// The module does not answer, or refuses that.
    pub fn press(&mut self, key: Key) -> Result<Step, Error> {
        let step = match key {
            Key::Left => self.refuel(false)?,
            Key::Right => self.refuel(true)?,
            Key::Stop => {
                self.stop()?;
                Step::Done
            }
            Key::Other => return Ok(Step::Over(JogEnd::Key)),
        };
        if self.late >= MOST_LATE {
            let millis = |time: Duration| time.as_millis() as u64;
            return Ok(Step::Over(JogEnd::Slow { round_ms: millis(self.round), most_ms: millis(LONGEST_ROUND) }));
        }
        Ok(step)
    }

    /// Ends the jog. The motor is stopped before anything else is done, or comes to rest by itself if the module is out
    /// of reach, and the axis gets its speed back. What could not be put back is the second part.
    pub fn end(mut self, ended: Result<JogEnd, Error>) -> (State, Option<Owed>) {
        let stopped = self.stop();
        let Axle { axis, speed, before, .. } = self.axle;
        let left = match stopped.and_then(|()| self.write_speed(before)) {
            Ok(()) => None,
            Err(_) => Some(Left { now: speed, before }).filter(|left| left.now != left.before),
        };
        let end = ended.unwrap_or_else(|error| self.failed(&error));
        let owed = left.map(|left| Owed { axis, speed: left.before });
        (State::JogEnded { axis, end, left }, owed)
    }

    fn at(&self, position: i32, speed: i32) -> State {
        State::Jogging { position, speed, unit: self.axle.unit }
    }

    fn position_and_speed(&mut self) -> Result<(i32, i32), Error> {
        let axis = self.axle.axis;
        let speed = self.module.axis(axis, AxisParameter::ActualSpeed)?;
        Ok((self.module.axis(axis, AxisParameter::ActualPosition)?, speed))
    }

    /// Gives the motor a target for a key.
    fn refuel(&mut self, rightwards: bool) -> Result<Step, Error> {
        let typed = self.module.time();
        let (position, speed) = self.position_and_speed()?;
        // What the replies have taken is no time to move.
        let elapsed = self.module.time().saturating_sub(typed);
        self.round = elapsed / 2;
        self.late = if self.round > LONGEST_ROUND { self.late + 1 } else { 0 };
        let Some(left) = fuel(self.round).checked_sub(elapsed) else { return Ok(Step::Done) };
        let target = self.axle.target(position, speed, rightwards, left);
        let absolute = 0;
        self.module.request(Command::new(Opcode::Mvp as u8, absolute, self.axle.axis, target))?;
        Ok(Step::Moving(self.at(position, speed)))
    }

    /// Stops the motor (MST).
    fn stop(&mut self) -> Result<(), Error> {
        let command = Command::new(Opcode::Mst as u8, 0, self.axle.axis, 0);
        self.module.request(command).map(drop)
    }

    fn write_speed(&mut self, speed: i32) -> Result<(), Error> {
        if self.axle.speed == self.axle.before {
            return Ok(());
        }
        Owed { axis: self.axle.axis, speed }.pay(self.module)
    }

    /// Tells what an error says about the module.
    fn failed(&mut self, error: &Error) -> JogEnd {
        let (number, bank) = SUPPLY;
        let locked = error.is(Status::NotAvailable);
        let supply = Command::new(Opcode::Gio as u8, number, bank, 0);
        let supply = if locked { self.module.value(supply).ok() } else { None };
        JogEnd::Failed { error: error.to_string(), supply }
    }
}
