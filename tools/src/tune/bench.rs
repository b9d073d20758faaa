//! The axis that is tuned: its settings, of which those that are changed are remembered, and its motor.

use std::time::Duration;

use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode};

use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::{Product, axis_number};
use crate::stop::Stop;
use crate::wire::LinkError;

/// MVP ABS.
const ABSOLUTE: u8 = 0;
/// How long a link that fails is tried again, to put the settings back.
const ENDURANCE: Duration = Duration::from_secs(10);
/// How long a motor may take to stop.
const STOPPING: Duration = Duration::from_secs(20);
/// Time between two questions to a motor that is waited for.
const GLANCE: Duration = Duration::from_millis(5);
/// Time between two attempts over a link that fails.
const PAUSE: Duration = Duration::from_millis(100);

/// An axis of a module, and what has been changed in it.
pub(super) struct Bench<'a> {
    /// The module.
    pub(super) module: Conversation,
    /// Opens the link anew, if it can.
    reopen: &'a mut dyn FnMut() -> Option<Conversation>,
    /// Whether to end.
    stop: &'a dyn Stop,
    /// The product that the module is.
    pub(super) product: Product,
    /// The number of the axis.
    pub(super) axis: u8,
    /// The parameters that were changed, with the values they had before.
    changed: Vec<(AxisParameter, i32)>,
    /// The motor has been sent somewhere.
    moved: bool,
    /// The module has answered, or refused, the last request.
    answers: bool,
    /// Time on the links before this one, each of which has a clock of its own.
    earlier: Duration,
}

impl<'a> Bench<'a> {
    /// The axis of a module, with nothing changed.
    pub(super) fn new(
        module: Conversation,
        reopen: &'a mut dyn FnMut() -> Option<Conversation>,
        stop: &'a dyn Stop,
        product: Product,
        axis: u8,
    ) -> Self {
        Bench {
            module,
            reopen,
            stop,
            product,
            axis,
            changed: Vec::new(),
            moved: false,
            answers: true,
            earlier: Duration::ZERO,
        }
    }

    /// Whether the product has a parameter.
    pub(super) fn has(&self, parameter: AxisParameter) -> bool {
        axis_number(Some(self.product), parameter).is_some()
    }

    /// The number of a parameter, which the product has.
    pub(super) fn number(&self, parameter: AxisParameter) -> u8 {
        axis_number(Some(self.product), parameter).unwrap_or_default()
    }

    /// The value of a parameter.
    pub(super) fn get(&mut self, parameter: AxisParameter) -> Result<i32, Failure> {
        let answer = self.module.axis(self.axis, parameter);
        self.heard(answer)
    }

    /// Writes a parameter, whose value is remembered the first time.
    pub(super) fn set(&mut self, parameter: AxisParameter, value: i32) -> Result<(), Failure> {
        if self.changed.iter().all(|(known, _)| *known != parameter) {
            let before = self.get(parameter)?;
            // A write whose reply is lost may have been carried out, so it is remembered before.
            self.changed.push((parameter, before));
        }
        let answer = self.module.request(self.write(parameter, value));
        self.heard(answer).map(|_| ())
    }

    /// Takes note of whether the module answers.
    fn heard<T>(&mut self, answer: Result<T, Error>) -> Result<T, Failure> {
        self.answers = answer.as_ref().map_or_else(Error::is_refusal, |_| true);
        Ok(answer?)
    }

    /// Whether the module has answered the last request: it can be told to bring the motor back.
    pub(super) fn answers(&self) -> bool {
        self.answers
    }

    /// Whether the module is inside this program, and ends with it.
    pub(super) fn is_simulated(&mut self) -> bool {
        self.module.simulated().is_some()
    }

    fn write(&self, parameter: AxisParameter, value: i32) -> Command {
        Command::new(Opcode::Sap as u8, self.number(parameter), self.axis, value)
    }

    /// Sends the motor to a position.
    pub(super) fn go_to(&mut self, position: i32) -> Result<(), Failure> {
        self.moved = true;
        let answer = self.module.request(self.go(position));
        self.heard(answer).map(|_| ())
    }

    fn go(&self, position: i32) -> Command {
        Command::new(Opcode::Mvp as u8, ABSOLUTE, self.axis, position)
    }

    /// Lets time pass: in a module inside this program its own.
    ///
    /// # Errors
    /// It has been asked to end.
    pub(super) fn pass(&mut self, time: Duration) -> Result<(), Failure> {
        if self.module.pause(time, self.stop) { Err(self.stop.interrupted("")) } else { Ok(()) }
    }

    /// Brings the motor back to a position.
    pub(super) fn bring_back(&mut self, position: i32) -> Result<(), Failure> {
        self.go_to(position)?;
        // Where it was seen last, and how many looks in a row before had shown it there as well.
        let mut seen = None;
        loop {
            let here = self.get(AxisParameter::ActualPosition)?;
            if here == position && self.get(AxisParameter::ActualSpeed)? == 0 {
                return Ok(());
            }
            let before = match seen {
                Some((place, before)) if place == here => before + 1,
                _ => 0,
            };
            seen = Some((here, before));
            if before > 100 {
                return Err(Failure::Failed(format!("the motor does not get back to {position}: it stands at {here}")));
            }
            self.pass(GLANCE)?;
        }
    }

    /// Stops the motor and puts all settings back, also over a link that fails for a while. Returns the commands that
    /// could not be sent.
    pub(super) fn restore(&mut self) -> Vec<Command> {
        self.stop.forget();
        let until = self.time() + ENDURANCE;
        let stop = self.moved.then(|| Command::new(Opcode::Mst as u8, 0, self.axis, 0));
        // What was changed last is put back first.
        let changed = std::mem::take(&mut self.changed).into_iter().rev();
        let writes: Vec<Command> = changed.map(|(parameter, before)| self.write(parameter, before)).collect();
        let mut left = Vec::new();
        let mut gone = false;
        for command in stop.into_iter().chain(writes) {
            // To a link that is gone nothing more is sent, because each command could take a whole time-out.
            let sent = if gone { None } else { Some(self.insist(command, until)) };
            match sent {
                Some(Ok(_)) if Some(command) == stop => self.await_standstill(until),
                Some(Ok(_)) => {}
                Some(Err(error)) => {
                    gone = !error.is_refusal();
                    left.push(command);
                }
                None => left.push(command),
            }
        }
        left
    }

    /// Waits until the motor stands; settings of a motor that turns can be put back as well, if they must.
    fn await_standstill(&mut self, until: Duration) {
        let speed = Command::new(Opcode::Gap as u8, self.number(AxisParameter::ActualSpeed), self.axis, 0);
        let latest = self.time() + STOPPING;
        while self.insist(speed, until).is_ok_and(|speed| speed != 0) && self.time() < latest {
            if self.module.pause(GLANCE, self.stop) {
                return;
            }
        }
    }

    /// Sends a command again and again until there is a reply, or until `until`; who asks to end ends that, too.
    fn insist(&mut self, command: Command, until: Duration) -> Result<i32, Error> {
        let mut told = false;
        loop {
            let error = match self.module.value(command) {
                Err(error) if !error.is_refusal() => error,
                answered => return answered,
            };
            if self.time() >= until || self.module.pause(PAUSE, self.stop) {
                return Err(error);
            }
            if !std::mem::replace(&mut told, true) {
                self.module.tell(&format!(
                    "the module does not answer; trying for up to {} seconds to put its settings back",
                    ENDURANCE.as_secs()
                ));
            }
            let gone = matches!(&error, Error::Link { error: LinkError::Closed | LinkError::Lost(_), .. });
            if gone && let Some(module) = (self.reopen)() {
                self.earlier = self.time();
                self.module = module;
            }
        }
    }

    /// Time since the measurement was prepared, on whatever link.
    fn time(&self) -> Duration {
        self.earlier + self.module.time()
    }

    /// Where the motor is, if the module says so.
    pub(super) fn whereabouts(&mut self) -> Option<i32> {
        self.get(AxisParameter::ActualPosition).ok()
    }
}
