//! A motor that is moved by holding a key.

use std::time::{Duration, Instant};

use tmcl_tools::conversation::Error;
use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode, Status};

use super::fuel::{Axle, LONGEST_ROUND, fuel};
use super::keys::{Key, Reader, sum};
use super::owed::Owed;
use super::state::{JogEnd, Left, State};
use super::{Shell, redraw};
use crate::failure::Failure;
use crate::terminal::raw::{Keys, Raw};

/// How often it is shown where the axis is, while no key comes.
const LOOK: Duration = Duration::from_millis(100);
/// How long the rest of a key may take that has come in part.
const REST_OF_KEY: Duration = Duration::from_millis(30);
/// So many keys one after the other whose replies take too long end a jog.
const MOST_LATE: u32 = 5;
/// Analog input that tells the supply voltage in tenths of volts, and the bank of the analog inputs.
const SUPPLY: (u8, u8) = (8, 1);

/// Lets the user move an axis by keys, until one of them, a signal or an error ends that. The motor stands then, or comes
/// to rest by itself if the module is out of reach.
pub(super) fn jog(shell: &mut Shell, axis: u8, speed: Option<i32>) -> Result<State, Failure> {
    if let Some(message) = shell.module.no_such_axis(axis)? {
        return Ok(State::Wrong { message });
    }
    let axle = Axle::read(&mut shell.module, axis, speed)?;
    if axle.speed < 1 {
        return Ok(State::Wrong {
            message: format!(
                "axis {axis} cannot be moved by keys: it slows down so gently that it would not stop in time, whatever its \
                 speed; give it a higher deceleration"
            ),
        });
    }
    let less = (axle.speed < axle.wanted).then_some(axle.wanted);
    shell.tell(&State::JogReady { axis, speed: axle.speed, wanted: less, unit: axle.unit })?;
    let mut raw = Raw::begin()?;
    let mut jog = Jog { shell, axle, reader: Reader::default(), late: 0, round: Duration::ZERO };
    let end = jog.stop_what_turns().and_then(|()| jog.set_speed()).and_then(|()| jog.follow(&mut raw));
    // A motor that can be stopped is stopped before anything else is done.
    let stopped = jog.stop();
    drop(raw);
    let left = match stopped.and_then(|()| jog.put_speed_back()) {
        Ok(()) => None,
        Err(_) => Some(Left { now: jog.axle.speed, before: jog.axle.before }),
    }
    .filter(|left| left.now != left.before);
    jog.shell.owed = left.map(|left| Owed { axis, speed: left.before });
    let end = match end {
        Ok(end) => end,
        Err(error) => jog.failed(&error),
    };
    // The terminal may be gone.
    let _ = redraw("");
    Ok(State::JogEnded { axis, end, left })
}

/// A jog that goes on.
struct Jog<'a> {
    shell: &'a mut Shell,
    axle: Axle,
    reader: Reader,
    /// How many keys one after the other were too late.
    late: u32,
    /// What a round trip has taken with the last key.
    round: Duration,
}

impl Jog<'_> {
    /// Does what keys ask for.
    fn follow(&mut self, raw: &mut Raw) -> Result<JogEnd, Error> {
        loop {
            let begun = Instant::now();
            let wait = if self.reader.has_begun() { REST_OF_KEY } else { LOOK };
            let keys = raw.keys(wait, &self.shell.signal);
            self.shell.pass(begun.elapsed());
            match keys {
                Keys::Typed(bytes) => {
                    let typed = Instant::now();
                    match sum(&self.reader.take(&bytes)) {
                        Some(Key::Left) => self.refuel(false, typed)?,
                        Some(Key::Right) => self.refuel(true, typed)?,
                        Some(Key::Stop) => self.stop()?,
                        Some(Key::Other) => return Ok(JogEnd::Key),
                        None => {}
                    }
                    if self.late >= MOST_LATE {
                        let millis = |time: Duration| time.as_millis() as u64;
                        return Ok(JogEnd::Slow { round_ms: millis(self.round), most_ms: millis(LONGEST_ROUND) });
                    }
                }
                // A key that has only begun is another one: Escape.
                Keys::Nothing if self.reader.has_begun() => return Ok(JogEnd::Key),
                Keys::Nothing => {
                    let (position, speed) = self.look()?;
                    self.show(position, speed);
                }
                Keys::Signal | Keys::Closed => return Ok(JogEnd::Signal),
            }
        }
    }

    /// Where the axis is, and its speed.
    fn look(&mut self) -> Result<(i32, i32), Error> {
        let (axis, module) = (self.axle.axis, &mut self.shell.module);
        let speed = module.axis(axis, AxisParameter::ActualSpeed)?;
        Ok((module.axis(axis, AxisParameter::ActualPosition)?, speed))
    }

    /// Gives the motor a target for a key that was `typed` then.
    fn refuel(&mut self, rightwards: bool, typed: Instant) -> Result<(), Error> {
        let (position, speed) = self.look()?;
        // What the replies have taken is no time to move.
        let elapsed = typed.elapsed();
        self.round = elapsed / 2;
        self.late = if self.round > LONGEST_ROUND { self.late + 1 } else { 0 };
        let Some(left) = fuel(self.round).checked_sub(elapsed) else { return Ok(()) };
        let target = self.axle.target(position, speed, rightwards, left);
        let absolute = 0;
        self.shell.module.request(Command::new(Opcode::Mvp as u8, absolute, self.axle.axis, target))?;
        self.show(position, speed);
        Ok(())
    }

    fn show(&self, position: i32, speed: i32) {
        // Without a terminal nobody looks; that it is gone is noticed where keys are read.
        let _ = redraw(&super::text::text(&State::Jogging { position, speed, unit: self.axle.unit }));
    }

    /// Stops a motor that somebody else has set in motion: it moves while a key is held, and only then.
    fn stop_what_turns(&mut self) -> Result<(), Error> {
        if self.look()?.1 == 0 { Ok(()) } else { self.stop() }
    }

    /// Stops the motor (MST).
    fn stop(&mut self) -> Result<(), Error> {
        let command = Command::new(Opcode::Mst as u8, 0, self.axle.axis, 0);
        self.shell.module.request(command).map(drop)
    }

    /// Gives the axis the speed of the jog for positioning.
    fn set_speed(&mut self) -> Result<(), Error> {
        self.write_speed(self.axle.speed)
    }

    /// Gives the axis back what it had.
    fn put_speed_back(&mut self) -> Result<(), Error> {
        self.write_speed(self.axle.before)
    }

    fn write_speed(&mut self, speed: i32) -> Result<(), Error> {
        if self.axle.speed == self.axle.before {
            return Ok(());
        }
        Owed { axis: self.axle.axis, speed }.pay(&mut self.shell.module)
    }

    /// What an error says about the module.
    fn failed(&mut self, error: &Error) -> JogEnd {
        let (number, bank) = SUPPLY;
        let locked = error.is(Status::NotAvailable);
        let supply = Command::new(Opcode::Gio as u8, number, bank, 0);
        let supply = if locked { self.shell.module.value(supply).ok() } else { None };
        JogEnd::Failed { error: error.to_string(), supply }
    }
}
