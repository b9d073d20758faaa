//! `tmcl shell`: a module's direct mode for somebody at a terminal.
//!
//! * `complete` - what the Tab key completes
//! * `watch` - parameters that are read again and again
//! * `jog` - a motor that moves while a key is held
//! * `keys` - the keys, of what a terminal sends

mod complete;
mod jog;
mod keys;
mod watch;

use std::io::Write;
use std::time::Duration;

use clap::Args;
use complete::Words;
use tmcl_link::EndSignal;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::product::Product;
use tmcl_tools::replies;
use tmcl_tools::request::Request;
use tmcl_tools::shell::{Action, Owed, State, text};
use tmcl_tools::stop::Stop;
use tmcm::tmcl::{Command, Opcode};

use crate::failure::{Ended, Failure};
use crate::link::LinkTarget;
use crate::reach::Reach;
use crate::tell;
use crate::terminal;
use crate::terminal::editor::{Editor, Input};

/// Talk to a module at a terminal: commands and their replies, parameters that are watched, a motor moved by keys
///
/// A line is a command as in programs, with names and expressions (`tmcl asm --names`); its reply comes in words. The
/// Tab key completes commands and names, the up arrow brings earlier lines back. `watch NAME...` shows parameters until
/// a key is pressed. `jog [AXIS] [SPEED]` moves a motor while the left or right arrow key is held. Each repetition of
/// the key gives it a target a little way ahead. So it stops within 300 ms when the key is released, the connection
/// breaks, or this program ends in whatever way. The speed is limited such that stopping takes no longer than 90 ms.
/// Meanwhile it is the speed of positioning (parameter 4), which gets its value back afterwards, unless the program was
/// killed. Motors that other commands have set in motion go on when the shell ends.
///
/// Without a terminal the lines are read from standard input, and `jog` is refused.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,
}

const EXAMPLES: &str = "\
Examples:
  tmcl shell sim                          a virtual module, to look around
  tmcl shell /dev/ttyACM0                 a module on USB
  tmcl shell tcp:127.0.0.1:4140           the module of tmcl sim --tcp 127.0.0.1:4140
  echo GAP 1, 0 | tmcl shell sim          lines from a pipe
Without a terminal the exit code is 1 if a line was not carried out.";

/// A command that every module answers, and that changes nothing: 135, which is not stored in download mode either.
const PRESENT: Command = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);
/// The text with which the shell asks for a line.
const PROMPT: &str = "(tmcl) ";

/// Reads lines and does what they ask for, until there are no more.
pub fn run(options: &Options) -> Result<(), Failure> {
    let signal = EndSignal::watch()?;
    let mut module = options.reach.open()?;
    // Nobody should have to type a command to find out that no module is there; one that does not tell what it is
    // answers this all the same.
    module.exchange(PRESENT)?;
    let identity = module.identity()?;
    let mut editor = Editor::open(Words::of(identity.product))?;
    let is_simulated = options.reach.link == LinkTarget::Simulated;
    let mut shell = Shell { module, signal, is_simulated, interactive: editor.is_terminal(), owed: None };
    if shell.interactive {
        tell(&State::Connected { module: format!("TMCM-{}", identity.number) })?;
    }
    let ended = shell.converse(&mut editor, identity.product);
    shell.put_back().and(ended)
}

/// The shell at work.
struct Shell {
    module: Conversation,
    signal: EndSignal,
    /// The module lives in this program, and its time passes only when it is told to.
    is_simulated: bool,
    /// Somebody sits at a terminal.
    interactive: bool,
    /// The settings that a jog could not put back.
    owed: Option<Owed>,
}

impl Shell {
    /// Reads lines and does what they ask for.
    fn converse(&mut self, editor: &mut Editor<Words>, product: Option<Product>) -> Result<(), Failure> {
        let mut all_done = true;
        loop {
            let line = match editor.line(PROMPT, &self.signal)? {
                Input::Line(line) => line,
                Input::Interrupted => continue,
                Input::End if self.signal.happened() => return Err(self.signal.failure("")),
                Input::End => break,
            };
            match Action::read(&line, product) {
                Ok(Action::Quit) => break,
                Ok(action) => all_done &= self.act(action)?,
                Err(message) => all_done &= self.wrong(message)?,
            }
            if self.signal.happened() {
                if !self.interactive || !self.signal.is_interrupt() {
                    return Err(self.signal.failure(""));
                }
                self.signal.forget();
            }
        }
        if all_done || self.interactive { Ok(()) } else { Err(Failure::Reported) }
    }

    /// Tries again to put back what a jog could not.
    fn put_back(&mut self) -> Result<(), Failure> {
        let Some(owed) = self.owed else { return Ok(()) };
        match owed.pay(&mut self.module) {
            Ok(()) => {
                self.owed = None;
                let state = State::PutBack { axis: owed.axis, speed: owed.speed };
                tell(&state).or_else(|failure| self.unless_ending(failure))
            }
            // That it is not what it was has been told when the jog ended.
            Err(_) => Ok(()),
        }
    }

    /// Does what a line asks for, and tells what comes of it. True if it was done.
    fn act(&mut self, action: Action) -> Result<bool, Failure> {
        if !matches!(action, Action::Nothing | Action::Help | Action::Quit) {
            self.put_back()?;
        }
        match action {
            Action::Nothing | Action::Quit => Ok(true),
            Action::Help => tell(&State::Help).map(|()| true),
            Action::Send { command, numeric } => match replies::ask(&mut self.module, Request { command, numeric }) {
                Ok(meaning) => {
                    let done = meaning.done;
                    let state = State::Answered { command: command.to_string(), answer: meaning.text, done };
                    tell(&state).map(|()| done)
                }
                Err(error) => self.wrong(error.to_string()),
            },
            Action::Watch { axis, parameters } => match watch::watch(self, axis, &parameters) {
                Ok(state) => state.map_or(Ok(()), |state| tell(&state)).map(|()| true),
                Err(Failure::Failed(message)) => self.wrong(message),
                Err(failure) => Err(failure),
            },
            Action::Jog { .. } if !self.interactive => {
                self.wrong("jog needs a terminal, because the motor moves only while a key is held there".into())
            }
            Action::Jog { axis, speed } => match jog::jog(self, axis, speed) {
                Ok(state) => tell(&state).or_else(|failure| self.unless_ending(failure)).map(|()| true),
                Err(Failure::Failed(message)) => self.wrong(message),
                Err(failure) => Err(failure),
            },
        }
    }

    /// Tells what is wrong; gives false, because nothing was done.
    fn wrong(&self, message: String) -> Result<bool, Failure> {
        writeln!(tell::err(), "tmcl: {}", text(&State::Wrong { message }))?;
        Ok(false)
    }

    /// With the terminal gone nothing can be told any more, and the signal is what counts.
    fn unless_ending(&self, failure: Failure) -> Result<(), Failure> {
        if self.signal.happened() { Ok(()) } else { Err(failure) }
    }

    /// Lets the time pass that somebody has waited, for a module whose time passes only so.
    fn pass(&mut self, time: Duration) {
        if self.is_simulated {
            self.module.pause(time, &self.signal);
        }
    }
}

/// Prints a state.
fn tell(state: &State) -> Result<(), Failure> {
    let mut out = tell::out();
    writeln!(out, "{}", text(state))?;
    Ok(out.flush()?)
}

/// Draws a line of the terminal anew, cut to its width; the cursor stays on it.
fn redraw(line: &str) -> Result<(), Failure> {
    Ok(tell::out().redraw(&terminal::fitting(line, terminal::columns()))?)
}
