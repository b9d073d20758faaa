//! The debugger: carries out what the user asks for, and tells by values what came of it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode};

use super::action::Action;
use super::breakpoints::{Breakpoint, Breakpoints, place_and_condition};
use super::condition::Condition;
use super::names::{Names, Parameter};
use super::place;
use super::quantity::Quantity;
use super::register::{Register, state};
use super::state::{Axis, Change, Farewell, Halt, Reading, Reason, Registers, Row, RunState, State, Stop, Told, View};
use super::subroutine::depth_behind;
use super::trouble::Trouble;
use crate::conversation::{Conversation, Error};
use crate::product::Product;
use crate::program::{Program, download};
use crate::progress::Progress;
use crate::replies::reply_to;
use crate::request::Request;
use crate::stop::Stop as Asked;

/// Number of commands that `list` shows.
const LINES: u16 = 11;
/// Number of commands that are shown at each stop before the next one, and as many behind it.
const AROUND: u16 = 2;
/// Interval at which the module is asked whether a WAIT is over.
const LOOK: Duration = Duration::from_millis(5);
/// Message about an action that needs a halted program.
const RUNS: &str = "the program runs; stop halts it";

/// Reads a program from its file, for a product.
pub type Read<'a> = dyn FnMut(&Path, Option<Product>) -> Result<Program, String> + 'a;

/// The surroundings of a debugger while it carries an action out.
pub struct Around<'a> {
    /// Whether a program that runs on is to be left alone.
    pub stop: &'a dyn Asked,
    /// Reads the program for a product anew; or tells why that is not possible, and that the module has the old one.
    pub read: &'a mut Read<'a>,
    /// Takes how far a download has got.
    pub progress: &'a mut dyn FnMut(Progress<'_>),
}

/// The outcome of a step.
enum Step {
    /// The command has been executed; the next command has this address.
    Done(u16),
    /// The command has ended the program.
    Ended,
    /// A signal has interrupted a WAIT, which is at this address.
    Interrupted(u16),
}

/// The debugger of the program in a module, which is given to it with each action.
pub struct Debugger {
    file: PathBuf,
    program: Program,
    names: Names,
    breakpoints: Breakpoints,
    /// The quantities that are watched, with the values at the last stop.
    watched: Vec<(Quantity, i64)>,
    /// Address at which the last step has ended the program, for display: the module's program counter is 0 again.
    ended: Option<u16>,
    /// Address behind the commands that were listed last.
    listed: u16,
    /// The number of axes, once it is known.
    axes: Option<u8>,
}

impl Debugger {
    /// A debugger of a program that is in the module. `file` is where it was read.
    pub fn new(module: &mut Conversation, file: PathBuf, program: Program) -> Result<Self, Error> {
        let names = Names::of(&program, module.product()?);
        let (breakpoints, watched) = (Breakpoints::new(), Vec::new());
        Ok(Debugger { file, program, names, breakpoints, watched, ended: None, listed: 0, axes: None })
    }

    /// The names that can be typed.
    pub fn names(&self) -> Vec<String> {
        self.names.all()
    }

    /// Carries an action out.
    pub fn act(&mut self, module: &mut Conversation, action: Action, around: &mut Around<'_>) -> Result<Told, Trouble> {
        use Action as A;
        if matches!(action, A::Step(_) | A::Next(_) | A::Continue | A::Stop | A::Reset | A::Reload | A::Send(_)) {
            self.ended = None;
        }
        match action {
            A::Step(times) => self.advance(module, Some(times), false, around.stop),
            A::Next(times) => self.advance(module, Some(times), true, around.stop),
            A::Continue if self.breakpoints.is_empty() => {
                module.control(Opcode::RunApplication, 0, 0)?;
                Ok(Told::Running)
            }
            A::Continue => self.advance(module, None, false, around.stop),
            A::Stop => {
                module.control(Opcode::StopApplication, 0, 0)?;
                self.whereabouts(module)
            }
            A::Reset => {
                module.control(Opcode::ResetApplication, 0, 0)?;
                self.whereabouts(module)
            }
            A::Break(None) => Ok(self.all_breakpoints()),
            A::Break(Some(typed)) => self.set_breakpoint(module, &typed),
            A::Delete(None) => {
                self.breakpoints.clear();
                Ok(self.all_breakpoints())
            }
            A::Delete(Some(typed)) => self.delete_breakpoint(&typed),
            A::Registers => Ok(Told::Registers(self.all_registers(module)?)),
            A::Axes => {
                let axes: Result<Vec<Axis>, Error> =
                    (0..self.axes(module)?).map(|number| self.axis(module, number)).collect();
                Ok(Told::Axes(axes?))
            }
            A::Print(typed) => {
                let quantity = Quantity::parse(&typed, &self.names)?;
                Ok(Told::Values(vec![quantity.read(module)?]))
            }
            A::Set(typed) => self.set(module, &typed),
            A::Watch(None) => Ok(Told::Watched(self.watched_now(module)?)),
            A::Watch(Some(typed)) => self.watch(module, &typed),
            A::Unwatch(typed) => self.unwatch(module, typed.as_deref()),
            A::List(typed) => self.list(module, typed.as_deref()),
            A::More => Ok(self.list_from(self.listed, None)),
            A::Reload => self.reload(module, around),
            A::Send(line) => {
                let request = Request::read(&line, self.names.product, &self.names.symbols)?;
                let reply = reply_to(module, request)?;
                Ok(Told::Reply { command: request.command.to_string(), reply })
            }
            A::Help => Ok(Told::Help),
            A::Quit => Ok(Told::Nothing),
        }
    }

    /// The state of the program and the commands around the next one.
    pub fn whereabouts(&mut self, module: &mut Conversation) -> Result<Told, Trouble> {
        let state = state(module)?;
        match state.program {
            RunState::Running => Ok(Told::Running),
            _ => Ok(Told::Halted(self.halt(module, Reason::Resting, state.counter)?)),
        }
    }

    /// All that there is to be seen at once.
    ///
    /// # Errors
    /// The link fails.
    pub fn view(&mut self, module: &mut Conversation) -> Result<View, Error> {
        let registers = self.all_registers(module)?;
        let used = self.names.used(&self.program);
        let variables = used.iter().filter_map(|typed| Quantity::parse(typed, &self.names).ok());
        let variables: Vec<Reading> = variables.map(|quantity| quantity.read(module)).collect::<Result<_, _>>()?;
        let watched = self.watched_now(module)?;
        let State { program, counter, .. } = registers.state;
        let at = self.ended.unwrap_or(counter);
        let next = (program != RunState::Running).then(|| self.row(at, Some(at)));
        let breakpoints = self.breakpoints.keys().map(|address| self.stop(*address)).collect();
        let ended = self.ended.is_some();
        Ok(View { registers, variables, watched, breakpoints, next, ended })
    }

    /// The state in which the module is left.
    pub fn farewell(&mut self, module: &mut Conversation) -> Result<Farewell, Error> {
        let state = state(module)?;
        let axes: Result<Vec<Axis>, Error> = (0..self.axes(module)?).map(|number| self.axis(module, number)).collect();
        Ok(Farewell { state, moving: axes?.into_iter().filter(|axis| axis.speed != 0).collect() })
    }

    /// The state of a program that must be halted.
    fn halted(module: &mut Conversation) -> Result<State, Trouble> {
        let state = state(module)?;
        match state.program {
            RunState::Running => Err(Trouble::Mistake(RUNS.into())),
            _ => Ok(state),
        }
    }

    /// Steps to a breakpoint or the end of the program, at most `most` steps. With `over` a subroutine is one step with
    /// the CSUB that calls it.
    fn advance(
        &mut self,
        module: &mut Conversation,
        most: Option<u32>,
        over: bool,
        stop: &dyn Asked,
    ) -> Result<Told, Trouble> {
        let (mut at, mut done, mut depth) = (Self::halted(module)?.counter, 0, 0);
        loop {
            let counter = match Self::step(module, stop)? {
                Step::Done(counter) => counter,
                Step::Ended => {
                    self.ended = Some(at);
                    return Ok(Told::Halted(self.halt(module, Reason::Ended, at)?));
                }
                Step::Interrupted(counter) => {
                    return Ok(Told::Halted(self.halt(module, Reason::Interrupted, counter)?));
                }
            };
            if over {
                depth = depth_behind(depth, &self.program, at, counter);
            }
            at = counter;
            done += u32::from(depth == 0);
            let reason = if depth == 0 && most == Some(done) {
                Reason::Stepped
            } else if self.halts_at(module, counter)? {
                Reason::Breakpoint
            } else if stop.happened() {
                Reason::Interrupted
            } else {
                continue;
            };
            return Ok(Told::Halted(self.halt(module, reason, counter)?));
        }
    }

    /// Executes the command at the program counter, or goes to the handler of an interrupt.
    fn step(module: &mut Conversation, stop: &dyn Asked) -> Result<Step, Error> {
        module.control(Opcode::StepApplication, 0, 0)?;
        loop {
            let now = state(module)?;
            if !now.waiting {
                let ended = now.program == RunState::Stopped;
                return Ok(if ended { Step::Ended } else { Step::Done(now.counter) });
            }
            if module.pause(LOOK, stop) {
                module.control(Opcode::StopApplication, 0, 0)?;
                return Ok(Step::Interrupted(state(module)?.counter));
            }
        }
    }

    /// True if there is a breakpoint at an address, and its condition holds.
    fn halts_at(&self, module: &mut Conversation, address: u16) -> Result<bool, Error> {
        match self.breakpoints.get(&address) {
            None => Ok(false),
            Some(Breakpoint { condition: None, .. }) => Ok(true),
            Some(Breakpoint { condition: Some(condition), .. }) => condition.holds(module),
        }
    }

    /// A halt at an address, with what has changed since the last one.
    fn halt(&mut self, module: &mut Conversation, reason: Reason, address: u16) -> Result<Halt, Error> {
        let around = address.saturating_sub(AROUND)..=address.saturating_add(AROUND);
        let around = around.filter(|near| *near == address || self.command(*near).is_some());
        let around = around.map(|near| self.row(near, Some(address))).collect();
        let mut changed = Vec::new();
        for (quantity, before) in &mut self.watched {
            let value = quantity.value(module)?;
            if value != *before {
                changed.push(Change { before: *before, now: quantity.read(module)? });
                *before = value;
            }
        }
        Ok(Halt { reason, around, changed })
    }

    fn all_registers(&mut self, module: &mut Conversation) -> Result<Registers, Error> {
        let state = state(module)?;
        let accumulator = Register::Accumulator.read(module)?;
        let x = Register::X.read(module)?;
        let axes = Some(self.axes(module)?).filter(|axes| *axes > 1).unwrap_or_default();
        let positions: Result<Vec<i32>, Error> =
            (0..axes).map(|axis| module.axis(axis, AxisParameter::ActualPosition)).collect();
        Ok(Registers { state, accumulator, x, positions: positions? })
    }

    /// The number of the module's axes.
    fn axes(&mut self, module: &mut Conversation) -> Result<u8, Error> {
        if let Some(axes) = self.axes {
            return Ok(axes);
        }
        let axes = module.axes()?;
        self.axes = Some(axes);
        Ok(axes)
    }

    fn axis(&mut self, module: &mut Conversation, number: u8) -> Result<Axis, Error> {
        let position = module.axis(number, AxisParameter::ActualPosition)?;
        let (speed, shown) = module.speed(number)?;
        Ok(Axis { number, position, speed, shown })
    }

    fn set(&mut self, module: &mut Conversation, typed: &str) -> Result<Told, Trouble> {
        let (what, value) = assignment(typed, &self.names)?;
        let quantity = Quantity::parse(what, &self.names)?;
        let value = self.names.number(value)?;
        if quantity.is_register() {
            Self::halted(module)?;
        }
        quantity.write(module, value)?;
        Ok(Told::Values(vec![quantity.read(module)?]))
    }

    fn watched_now(&self, module: &mut Conversation) -> Result<Vec<Reading>, Error> {
        self.watched.iter().map(|(quantity, _)| quantity.read(module)).collect()
    }

    fn watch(&mut self, module: &mut Conversation, typed: &str) -> Result<Told, Trouble> {
        let quantity = Quantity::parse(typed, &self.names)?;
        let reading = quantity.read(module)?;
        self.watched.retain(|(other, _)| *other != quantity);
        self.watched.push((quantity, reading.value));
        Ok(Told::Values(vec![reading]))
    }

    fn unwatch(&mut self, module: &mut Conversation, typed: Option<&str>) -> Result<Told, Trouble> {
        let count = self.watched.len();
        match typed {
            None => self.watched.clear(),
            Some(typed) => self.watched.retain(|(quantity, _)| !quantity.typed.eq_ignore_ascii_case(typed)),
        }
        match typed {
            Some(typed) if self.watched.len() == count => Err(Trouble::Mistake(format!("'{typed}' is not watched"))),
            _ => Ok(Told::Watched(self.watched_now(module)?)),
        }
    }

    fn list(&mut self, module: &mut Conversation, typed: Option<&str>) -> Result<Told, Trouble> {
        let counter = match self.ended {
            Some(address) => address,
            None => state(module)?.counter,
        };
        let first = match typed {
            None => counter.saturating_sub(LINES / 2),
            Some(typed) => self.address(typed)?,
        };
        Ok(self.list_from(first, Some(counter)))
    }

    fn list_from(&mut self, first: u16, counter: Option<u16>) -> Told {
        let addresses = first..=first.saturating_add(LINES - 1);
        let known = addresses.filter(|address| self.command(*address).is_some());
        let rows: Vec<Row> = known.map(|address| self.row(address, counter)).collect();
        self.listed = rows.last().map_or(first, |row| row.address.saturating_add(1));
        if rows.is_empty() { Told::Listing(vec![self.row(first, counter)]) } else { Told::Listing(rows) }
    }

    fn all_breakpoints(&self) -> Told {
        Told::Breakpoints(self.breakpoints.keys().map(|address| self.stop(*address)).collect())
    }

    fn set_breakpoint(&mut self, module: &mut Conversation, typed: &str) -> Result<Told, Trouble> {
        let (place, condition) = place_and_condition(typed);
        let address = self.address(place)?;
        let condition = condition.map(|typed| Condition::parse(typed, &self.names)).transpose()?;
        if let Some(condition) = &condition {
            // What cannot be read is told now, and not when the program comes by.
            condition.holds(module)?;
        }
        self.breakpoints.insert(address, Breakpoint { place: place.into(), condition });
        Ok(Told::Breakpoints(vec![self.stop(address)]))
    }

    fn delete_breakpoint(&mut self, typed: &str) -> Result<Told, Trouble> {
        let address = self.address(typed)?;
        match self.breakpoints.remove(&address) {
            Some(_) => Ok(self.all_breakpoints()),
            None => Err(Trouble::Mistake(format!("there is no breakpoint at address {address}"))),
        }
    }

    /// Reads the file again and loads it. Breakpoints and watched values are found anew by what the user has typed.
    fn reload(&mut self, module: &mut Conversation, around: &mut Around<'_>) -> Result<Told, Trouble> {
        let program = (around.read)(&self.file, self.names.product)?;
        module.control(Opcode::StopApplication, 0, 0)?;
        download(module, &program, 0, around.stop, around.progress)?;
        module.control(Opcode::ResetApplication, 0, 0)?;
        self.names = Names::of(&program, self.names.product);
        self.program = program;
        let mut lost = Vec::new();
        for (_, Breakpoint { place, condition }) in std::mem::take(&mut self.breakpoints) {
            let condition = condition.map(|condition| Condition::parse(&condition.typed, &self.names)).transpose();
            match (self.address(&place), condition) {
                (Ok(address), Ok(condition)) => {
                    self.breakpoints.insert(address, Breakpoint { place, condition });
                }
                _ => lost.push(format!("break {place}")),
            }
        }
        for (quantity, before) in std::mem::take(&mut self.watched) {
            match Quantity::parse(&quantity.typed, &self.names) {
                Ok(quantity) => self.watched.push((quantity, before)),
                Err(_) => lost.push(format!("watch {}", quantity.typed)),
            }
        }
        let counter = state(module)?.counter;
        let halt = self.halt(module, Reason::Resting, counter)?;
        Ok(Told::Reloaded { commands: self.program.commands.len(), lost, halt })
    }

    fn address(&self, typed: &str) -> Result<u16, String> {
        place::address(typed, &self.program, &self.names, &self.file)
    }

    fn command(&self, address: u16) -> Option<Command> {
        self.program.commands.get(usize::from(address)).copied()
    }

    fn row(&self, address: u16, counter: Option<u16>) -> Row {
        let here = self.program.labels.iter().filter(|(_, labelled)| *labelled == address);
        Row {
            address,
            labels: here.map(|(name, _)| name.clone()).collect(),
            current: counter == Some(address),
            breakpoint: self.breakpoints.contains_key(&address),
            command: self.command(address).map(|command| command.to_string()),
            line: self.program.line(address).cloned(),
        }
    }

    fn stop(&self, address: u16) -> Stop {
        let condition = self.breakpoints.get(&address).and_then(|breakpoint| breakpoint.condition.as_ref());
        Stop { row: self.row(address, None), condition: condition.map(|condition| condition.typed.clone()) }
    }
}

/// Cuts what is typed behind `set` into the name and the value: at a `=`, or else behind the first word. With
/// `variable` or `register` or the name of a parameter of an axis the cut is behind the word that follows it.
fn assignment<'a>(typed: &'a str, names: &Names) -> Result<(&'a str, &'a str), String> {
    let missing = || "what, and to which value? For example: set acc 5".to_owned();
    let (what, value) = match typed.split_once('=') {
        Some(cut) => cut,
        None => {
            let first = typed.split_whitespace().next().unwrap_or_default();
            let is_two = ["variable", "register"].iter().any(|word| first.eq_ignore_ascii_case(word));
            // Behind a parameter there may be an axis and the value, which are no expression together.
            let behind = typed.get(first.len()..).unwrap_or_default().trim();
            let has_axis = matches!(names.parameter(first.trim_end_matches(',')), Some(Parameter::Axis(_)))
                && behind.contains(char::is_whitespace)
                && names.number(behind).is_err();
            let mut spaces = typed.match_indices(char::is_whitespace).map(|(at, _)| at);
            let end = spaces.nth(usize::from(is_two || has_axis)).ok_or_else(missing)?;
            typed.split_at_checked(end).ok_or_else(missing)?
        }
    };
    if what.trim().is_empty() || value.trim().is_empty() {
        Err(missing())
    } else {
        Ok((what.trim().trim_end_matches(','), value.trim()))
    }
}
