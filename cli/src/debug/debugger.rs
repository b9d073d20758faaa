//! The debugger: controls and shows the module's program by commands 128 to 135.

use std::collections::BTreeSet;
use std::time::Duration;

use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode};

use super::action::{Action, HELP};
use crate::conversation::{Conversation, Error};
use crate::program::{Line, Program};
use crate::send;
use crate::signal::EndSignal;
use crate::suggest::suggestion;

/// Number of commands that `list` shows.
const LINES: u16 = 11;
/// Width of the column of commands; the source line follows behind it.
const SOURCE: usize = 30;
/// Interval at which the module is asked whether a WAIT is over.
const LOOK: Duration = Duration::from_millis(5);

/// State of the program, as global parameter 128 and command 135 number it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RunState {
    Stopped,
    Running,
    Stepping,
    Reset,
    Unknown(u8),
}

impl RunState {
    fn name(self) -> String {
        match self {
            RunState::Stopped => "stopped".into(),
            RunState::Running => "running".into(),
            RunState::Stepping => "step by step".into(),
            RunState::Reset => "reset".into(),
            RunState::Unknown(number) => format!("unknown mode {number}"),
        }
    }
}

/// The reply to command 135, type 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct State {
    program: RunState,
    /// True while the program is in a WAIT.
    waiting: bool,
    /// The program counter.
    counter: u16,
}

impl State {
    fn of(value: i32) -> Self {
        let [mode, waiting, high, low] = value.to_be_bytes();
        let mode = match mode {
            0 => RunState::Stopped,
            1 => RunState::Running,
            2 => RunState::Stepping,
            3 => RunState::Reset,
            number => RunState::Unknown(number),
        };
        State { program: mode, waiting: waiting != 0, counter: u16::from_be_bytes([high, low]) }
    }
}

/// Types of command 135.
mod kind {
    pub(super) const PROGRAM_COUNTER: u8 = 1;
    pub(super) const ACCUMULATOR: u8 = 2;
    pub(super) const X_REGISTER: u8 = 3;
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

/// The debugger of the program in a module.
pub(super) struct Debugger<'a> {
    module: &'a mut Conversation,
    program: &'a Program,
    breakpoints: BTreeSet<u16>,
    /// Address at which the last step has ended the program, for display: the module's program counter is 0 again.
    ended: Option<u16>,
    /// The number of axes, once it is known.
    axes: Option<u8>,
}

impl<'a> Debugger<'a> {
    pub(super) fn new(module: &'a mut Conversation, program: &'a Program) -> Self {
        Debugger { module, program, breakpoints: BTreeSet::new(), ended: None, axes: None }
    }

    /// Carries an action out and returns the text for the user.
    pub(super) fn act(&mut self, action: Action, signal: &mut EndSignal) -> Result<String, Error> {
        if matches!(action, Action::Step(_) | Action::Continue | Action::Stop | Action::Reset | Action::Send(_)) {
            self.ended = None;
        }
        match action {
            Action::Step(times) => self.advance(Some(times), signal),
            Action::Continue if self.breakpoints.is_empty() => {
                self.module.control(Opcode::RunApplication, 0, 0)?;
                Ok("running; stop halts it".into())
            }
            Action::Continue => self.advance(None, signal),
            Action::Stop => {
                self.module.control(Opcode::StopApplication, 0, 0)?;
                self.whereabouts()
            }
            Action::Reset => {
                self.module.control(Opcode::ResetApplication, 0, 0)?;
                self.whereabouts()
            }
            Action::Break(None) => Ok(self.list_breakpoints()),
            Action::Break(Some(typed)) => Ok(self.set_breakpoint(&typed).unwrap_or_else(|message| message)),
            Action::Delete(None) => {
                self.breakpoints.clear();
                Ok("no breakpoints".into())
            }
            Action::Delete(Some(typed)) => Ok(self.delete_breakpoint(&typed).unwrap_or_else(|message| message)),
            Action::Registers => self.registers(),
            Action::Axes => self.show_axes(),
            Action::List(typed) => self.list(typed),
            Action::Send(request) => Ok(format!("{}: {}", request.command, send::ask(self.module, request)?.text)),
            Action::Help => Ok(HELP.into()),
            Action::Quit | Action::Nothing => Ok(String::new()),
        }
    }

    /// The state of the program and the next command, as text.
    pub(super) fn whereabouts(&mut self) -> Result<String, Error> {
        let state = self.state()?;
        match state.program {
            RunState::Running => Ok("running; stop halts it".into()),
            _ => Ok(self.line(state.counter, Some(state.counter))),
        }
    }

    /// The state in which the module is left, as text.
    pub(super) fn farewell(&mut self) -> Result<String, Error> {
        let state = self.state()?;
        let mut text = match state.program {
            RunState::Running => "the program goes on running in the module; command 128 stops it".into(),
            _ => format!("the program is stopped at address {}", state.counter),
        };
        for axis in 0..self.axes()? {
            let (speed, shown) = self.module.speed(axis)?;
            if speed != 0 {
                text += &format!("\nmotor {axis} turns with speed {shown}; MST {axis} stops it");
            }
        }
        Ok(text)
    }

    fn state(&mut self) -> Result<State, Error> {
        self.module.control(Opcode::ApplicationStatus, kind::PROGRAM_COUNTER, 0).map(State::of)
    }

    /// Steps to a breakpoint or the end of the program, at most `most` steps.
    fn advance(&mut self, most: Option<u32>, signal: &mut EndSignal) -> Result<String, Error> {
        let state = self.state()?;
        if state.program == RunState::Running {
            return Ok(RUNS.into());
        }
        let (mut at, mut done) = (state.counter, 0);
        loop {
            let counter = match self.step(signal)? {
                Step::Done(counter) => counter,
                Step::Ended => {
                    self.ended = Some(at);
                    return Ok(format!(
                        "the program has ended; the next step begins it again\n{}",
                        self.line(at, Some(at))
                    ));
                }
                Step::Interrupted(counter) => return Ok(self.interrupted(counter)),
            };
            (at, done) = (counter, done + 1);
            if most == Some(done) {
                return Ok(self.line(counter, Some(counter)));
            }
            if self.breakpoints.contains(&counter) {
                return Ok(format!("breakpoint\n{}", self.line(counter, Some(counter))));
            }
            if signal.happened() {
                signal.forget();
                return Ok(self.interrupted(counter));
            }
        }
    }

    /// Executes the command at the program counter, or goes to the handler of an interrupt.
    fn step(&mut self, signal: &mut EndSignal) -> Result<Step, Error> {
        self.module.control(Opcode::StepApplication, 0, 0)?;
        loop {
            let state = self.state()?;
            if !state.waiting {
                let ended = state.program == RunState::Stopped;
                return Ok(if ended { Step::Ended } else { Step::Done(state.counter) });
            }
            if signal.within(LOOK) {
                signal.forget();
                self.module.control(Opcode::StopApplication, 0, 0)?;
                return Ok(Step::Interrupted(self.state()?.counter));
            }
        }
    }

    fn interrupted(&self, counter: u16) -> String {
        format!("interrupted\n{}", self.line(counter, Some(counter)))
    }

    fn registers(&mut self) -> Result<String, Error> {
        let State { program: mode, waiting, counter } = self.state()?;
        let accumulator = self.module.control(Opcode::ApplicationStatus, kind::ACCUMULATOR, 0)?;
        let x = self.module.control(Opcode::ApplicationStatus, kind::X_REGISTER, 0)?;
        let waiting = if waiting { ", in a WAIT" } else { "" };
        let mut text = format!("{}{waiting}, program counter {counter}, accumulator {accumulator}, X {x}", mode.name());
        let axes = self.axes()?;
        if axes > 1 {
            let positions: Result<Vec<String>, Error> =
                (0..axes).map(|axis| Ok(self.module.axis(axis, AxisParameter::ActualPosition)?.to_string())).collect();
            text += &format!("\npositions {}", positions?.join(", "));
        }
        Ok(text)
    }

    /// The number of the module's axes.
    fn axes(&mut self) -> Result<u8, Error> {
        if let Some(axes) = self.axes {
            return Ok(axes);
        }
        let axes = self.module.axes()?;
        self.axes = Some(axes);
        Ok(axes)
    }

    fn show_axes(&mut self) -> Result<String, Error> {
        let mut lines = Vec::new();
        for axis in 0..self.axes()? {
            let position = self.module.axis(axis, AxisParameter::ActualPosition)?;
            let (_, speed) = self.module.speed(axis)?;
            lines.push(format!("axis {axis}: position {position}, speed {speed}"));
        }
        Ok(lines.join("\n"))
    }

    fn list(&mut self, typed: Option<String>) -> Result<String, Error> {
        let counter = self.ended.map_or_else(|| self.state().map(|state| state.counter), Ok)?;
        let first = match typed.map(|typed| self.address_of(&typed)) {
            None => counter.saturating_sub(LINES / 2),
            Some(Ok(address)) => address,
            Some(Err(message)) => return Ok(message),
        };
        let addresses = first..=first.saturating_add(LINES - 1);
        let known = addresses.filter(|address| self.command(*address).is_some());
        let lines: Vec<String> = known.map(|address| self.line(address, Some(counter))).collect();
        if lines.is_empty() { Ok(self.line(first, None)) } else { Ok(lines.join("\n")) }
    }

    fn list_breakpoints(&self) -> String {
        if self.breakpoints.is_empty() {
            return "no breakpoints".into();
        }
        let lines: Vec<String> = self.breakpoints.iter().map(|address| self.line(*address, None)).collect();
        lines.join("\n")
    }

    fn set_breakpoint(&mut self, typed: &str) -> Result<String, String> {
        let address = self.address_of(typed)?;
        self.breakpoints.insert(address);
        Ok(self.line(address, None))
    }

    fn delete_breakpoint(&mut self, typed: &str) -> Result<String, String> {
        let address = self.address_of(typed)?;
        if self.breakpoints.remove(&address) {
            Ok(self.list_breakpoints())
        } else {
            Err(format!("there is no breakpoint at address {address}"))
        }
    }

    /// The address that the user has typed, as a number or a label.
    fn address_of(&self, text: &str) -> Result<u16, String> {
        let address = text.parse().ok().or_else(|| self.program.address(text));
        match address {
            Some(address) if self.command(address).is_some() => Ok(address),
            Some(address) => Err(format!("the program ends before address {address}")),
            None => {
                let labels = self.program.labels.iter().map(|(name, _)| name.as_str());
                let hint = suggestion(text, labels);
                Err(format!("'{text}' is neither an address nor a label of the program{hint}"))
            }
        }
    }

    fn command(&self, address: u16) -> Option<Command> {
        self.program.commands.get(usize::from(address)).copied()
    }

    /// The lines that show a command: the labels of its address, then an arrow at the program counter, a star at a
    /// breakpoint, the command and its source line.
    fn line(&self, address: u16, counter: Option<u16>) -> String {
        let here = self.program.labels.iter().filter(|(_, labelled)| *labelled == address);
        let labels: String = here.map(|(name, _)| format!("{name}:\n")).collect();
        let arrow = if counter == Some(address) { '>' } else { ' ' };
        let star = if self.breakpoints.contains(&address) { '*' } else { ' ' };
        let command = self.command(address).map_or_else(|| "(not in the file)".into(), |command| command.to_string());
        let line = format!("{labels}{arrow}{star}{address:5}  ");
        match self.program.line(address) {
            Some(Line { position, text }) => format!("{line}{command:SOURCE$} {position:>4}  {text}"),
            None => line + &command,
        }
    }
}

/// Message about an action that needs a halted program.
const RUNS: &str = "the program runs; stop halts it";
