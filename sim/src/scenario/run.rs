//! Carries the steps of a case out.

use std::any::Any;
use std::collections::{HashMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::control::{Control, Line};
use tmcm::can::{CanFrame, Frame};
use tmcm::tmcl::{Command, Opcode, Status};

use super::condition::{Condition, Sum, Template, Values};
use super::program::Program;
use super::sdo::{self, Object};
use super::step::{Answer, Pattern, Step};
use super::{Case, Mistake, Rig};
use crate::look::Look;
use crate::wire::meaning;

/// How long `power cycle` leaves the supply off, and how long it waits for the module to start.
const OFF: Nanos = 100 * MILLISECOND;
/// How often something is looked at that lasts or is waited for.
const GLANCE: Nanos = MILLISECOND;
/// How often it is looked for a frame.
const FRAME_GLANCE: Nanos = MILLISECOND / 4;
/// Longest wait for the reply to an SDO request: more than saving all parameters takes.
const PATIENCE: Nanos = 2 * SECOND;
/// Most frames that are kept for `wait ... for frame`; the oldest go first.
const MOST_FRAMES: usize = 10_000;

/// Runs a case on a module that has just started in the world of the case.
///
/// # Errors
/// The line of the first step that failed, and how it did.
pub fn run_case(case: &Case, rig: impl Rig) -> Result<(), Mistake> {
    let mut runner = Runner { rig, remembered: HashMap::new(), frames: VecDeque::new() };
    for (source, step) in &case.steps {
        let result = catch_unwind(AssertUnwindSafe(|| runner.step(step)))
            .unwrap_or_else(|panic| Err(format!("panicked: {}", said(&*panic))));
        let result = runner.rig.stopped().map_or(result, Err);
        result.map_err(|message| Mistake::new(source.number, format!("{}: {message}", source.text)))?;
    }
    Ok(())
}

/// The message of a panic.
pub(super) fn said(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    text.unwrap_or("nothing").into()
}

struct Runner<R> {
    rig: R,
    remembered: HashMap<String, f64>,
    /// Frames of the module that nobody has waited for yet; replies to SDO requests of this host are left out.
    frames: VecDeque<Frame>,
}

impl<R: Rig> Values for Runner<R> {
    fn look(&mut self, look: &Look) -> Result<f64, String> {
        Ok(self.rig.look(look))
    }

    fn read(&mut self, command: Command) -> Result<f64, String> {
        match self.rig.send(command) {
            Some((100, value)) => Ok(value.into()),
            Some((status, _)) => Err(format!("{} {}", name(command), answered(status))),
            None => Err(format!("{}: no reply", name(command))),
        }
    }

    fn object(&mut self, object: Object) -> Result<f64, String> {
        match self.transfer(object, object.upload())? {
            sdo::Answer::Value(value) => Ok(value as f64),
            sdo::Answer::Aborted(code) => Err(format!("the node aborts with {code:#010X}")),
            sdo::Answer::Written => Err("the node answers as if the object had been written".into()),
        }
    }

    fn remembered(&self, name: &str) -> Option<f64> {
        self.remembered.get(name).copied()
    }
}

/// A status that no step wants, in words.
fn answered(status: u8) -> String {
    format!("answered status {status} ({})", meaning(status))
}

/// The mnemonic of a command, or its number where it has none.
fn name(command: Command) -> String {
    let mnemonic = Opcode::from_number(command.opcode).map(|opcode| opcode.instruction().mnemonic);
    mnemonic.filter(|name| !name.is_empty()).map_or_else(|| command.opcode.to_string(), Into::into)
}

impl<R: Rig> Runner<R> {
    fn step(&mut self, step: &Step) -> Result<(), String> {
        match step {
            Step::Command { command, answer } => return self.command(command, answer),
            Step::Post(command) => {
                let command = command.command(self)?;
                self.rig.post(command);
            }
            Step::At(time) => return self.wait_to(*time),
            Step::Expect { condition, hold } => return self.expect(condition, *hold),
            Step::Wait { span, until: None } => self.rig.pass(*span),
            Step::Wait { span, until: Some(condition) } => return self.wait(*span, condition),
            Step::Await { span, pattern } => return self.wait_for(*span, pattern),
            Step::Let { name, value } => {
                let value = value.value(self)?;
                self.remembered.insert(name.clone(), value);
            }
            Step::Control { delay: None, line } => return self.rig.control(line),
            Step::Control { delay: Some(delay), line } => return self.rig.control_at(*delay, line),
            Step::PowerCycle => {
                for on in [false, true] {
                    self.rig.control(&Line { module: 1, control: Control::Power { on } })?;
                    self.rig.pass(OFF);
                }
            }
            Step::Load(program) => return self.load(program),
            Step::Run(address) => {
                let (kind, address) = address.map_or((0, 0), |address| (1, address));
                return self.must(Command::new(Opcode::RunApplication as u8, kind, 0, address.into()), Status::Ok);
            }
            Step::Sdo { object, value, abort } => return self.sdo(*object, value.as_ref(), *abort),
            Step::Frame(frame) => self.rig.send_frame(*frame),
        }
        Ok(())
    }

    fn command(&mut self, command: &Template, answer: &Answer) -> Result<(), String> {
        let command = command.command(self)?;
        let reply = self.rig.send(command);
        let Answer::Status { status: wanted, value: wanted_value } = answer else {
            let why = |(status, value)| format!("{}, value {value}", answered(status));
            return reply.map_or(Ok(()), |reply| Err(why(reply)));
        };
        let Some((status, value)) = reply else { return Err("no reply".into()) };
        if status != *wanted {
            return Err(answered(status));
        }
        if let Some(wanted) = wanted_value
            && wanted.value(self)? != f64::from(value)
        {
            return Err(format!("answered value {value}"));
        }
        Ok(())
    }

    fn expect(&mut self, condition: &Condition, hold: Nanos) -> Result<(), String> {
        let end = self.rig.now() + hold;
        loop {
            if let Some(why) = condition.violated(self)? {
                return Err(why);
            }
            if self.rig.now() >= end {
                return Ok(());
            }
            self.rig.pass(GLANCE);
        }
    }

    fn wait_to(&mut self, time: Nanos) -> Result<(), String> {
        let now = self.rig.now();
        let span = time.checked_sub(now).ok_or_else(|| format!("it is {} us already", now / MICROSECOND))?;
        self.rig.pass(span);
        Ok(())
    }

    fn wait(&mut self, limit: Nanos, condition: &Condition) -> Result<(), String> {
        let end = self.rig.now() + limit;
        while let Some(why) = condition.violated(self)? {
            if self.rig.now() >= end {
                return Err(format!("not in this time: {why}"));
            }
            self.rig.pass(GLANCE);
        }
        Ok(())
    }

    /// Puts a program into the module as `tmcl load` does.
    fn load(&mut self, program: &Program) -> Result<(), String> {
        self.must(Command::new(Opcode::ResetApplication as u8, 0, 0, 0), Status::Ok)?;
        self.must(Command::new(Opcode::EnterDownload as u8, 0, 0, 0), Status::Ok)?;
        for command in &program.commands {
            self.must(*command, Status::Loaded)?;
        }
        self.must(Command::new(Opcode::ExitDownload as u8, 0, 0, 0), Status::Ok)
    }

    fn must(&mut self, command: Command, wanted: Status) -> Result<(), String> {
        match self.rig.send(command) {
            Some((status, _)) if status == wanted as u8 => Ok(()),
            Some((status, _)) => Err(format!("{command} {}", answered(status))),
            None => Err(format!("{command}: no reply")),
        }
    }

    fn sdo(&mut self, object: Object, value: Option<&Sum>, abort: Option<u32>) -> Result<(), String> {
        let request = match value {
            Some(value) => object.download(value.value(self)?)?,
            None => object.upload(),
        };
        match (self.transfer(object, request)?, abort) {
            (sdo::Answer::Aborted(code), Some(wanted)) if code == wanted => Ok(()),
            (sdo::Answer::Aborted(code), _) => Err(format!("the node aborts with {code:#010X}")),
            (_, Some(_)) => Err("the node does not abort".into()),
            (sdo::Answer::Written, None) => Ok(()),
            (sdo::Answer::Value(_), None) => Err("the node answers as if the object had been read".into()),
        }
    }

    /// Sends an SDO request and waits for its reply.
    fn transfer(&mut self, object: Object, request: Frame) -> Result<sdo::Answer, String> {
        self.rig.send_frame(request);
        let end = self.rig.now() + PATIENCE;
        loop {
            while let Some(frame) = self.rig.frame() {
                match object.answer(&frame) {
                    Some(answer) => return answer,
                    None => self.keep(frame),
                }
            }
            if self.rig.now() >= end {
                return Err("no reply".into());
            }
            self.rig.pass(FRAME_GLANCE);
        }
    }

    fn keep(&mut self, frame: Frame) {
        if self.frames.len() >= MOST_FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back(frame);
    }

    /// Waits for a frame that has come since the last one that was waited for, or comes now. What came before it is
    /// forgotten.
    fn wait_for(&mut self, limit: Nanos, pattern: &Pattern) -> Result<(), String> {
        let end = self.rig.now() + limit;
        let mut last = None;
        loop {
            while let Some(frame) = self.rig.frame() {
                self.keep(frame);
            }
            while let Some(frame) = self.frames.pop_front() {
                if !sdo::is(&frame, pattern.id) {
                    continue;
                }
                if frame.data().starts_with(&pattern.data) {
                    return Ok(());
                }
                last = Some(frame);
            }
            if self.rig.now() >= end {
                let seen = last.map_or_else(String::new, |frame| format!("; the last one had {}", hex(frame.data())));
                return Err(format!("no such frame in this time{seen}"));
            }
            self.rig.pass(FRAME_GLANCE);
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}
