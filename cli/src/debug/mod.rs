//! `tmcl debug`: a program in a module, step by step.
//!
//! TMCL has no breakpoints. The host lets the module execute one command at a time, and compares the program counter
//! with its own list of breakpoints.

mod action;
mod debugger;

use std::io::Write;
use std::path::Path;

use clap::Args;
use tmcm::tmcl::Opcode;

use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::files::STANDARD;
use crate::program::{ProgramThere, download, is_readable, read_program, verify};
use crate::signal::EndSignal;
use crate::terminal::editor::{Editor, Input, NoCompletion};
use action::Action;
use debugger::Debugger;

/// Run a TMCL program in a module step by step, with breakpoints
///
/// Loads FILE, a source or an assembled program as for `tmcl load`, and waits at its first command. Then it takes
/// commands, one a line, from the terminal or from a pipe; `help` lists them. With a source (.tmc) addresses may be
/// given as labels, and source lines are shown beside the commands. The motors really move. While there are
/// breakpoints the program runs as fast as the link allows, some hundred commands a second. Ctrl-C halts a program
/// that runs.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module and its program
    #[command(flatten)]
    pub program: ProgramThere,

    /// Do not load the program: the module has it already, and may be running it
    #[arg(long)]
    pub attach: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl debug /dev/ttyACM0 stage.tmc                  load it and wait at its first command
  tmcl debug tcp:127.0.0.1:4140 stage.tmc --attach   look at what a module is doing
  printf 'break Loop\\ncontinue\\nregisters\\n' | tmcl debug sim stage.tmc";

/// Debugs until the user quits, and prints the state in which the module is left.
pub fn run(options: &Options) -> Result<(), Failure> {
    if options.program.file == Path::new(STANDARD) {
        let message = "the program has to be in a file: standard input has the commands of the debugger";
        return Err(Failure::Failed(message.into()));
    }
    let mut signal = EndSignal::watch()?;
    let mut module = Conversation::open(&options.program.reach)?;
    let program = read_program(&options.program.file, module.product()?)?;
    if options.attach {
        // A program that is protected from being read cannot be compared with the file.
        if is_readable(&mut module)? {
            verify(&mut module, &program, 0, &signal)?;
        }
    } else {
        download(&mut module, &program, 0, &signal)?;
        module.control(Opcode::ResetApplication, 0, 0)?;
    }
    let mut out = std::io::stdout().lock();
    let mut input = Editor::open(NoCompletion)?;
    let prompt = if input.is_terminal() { "(tmcl) " } else { "" };
    let mut debugger = Debugger::new(&mut module, &program);
    writeln!(out, "{}", debugger.whereabouts()?)?;
    loop {
        let action = match input.line(prompt, &signal)? {
            Input::Line(line) => Action::parse(&line),
            Input::Interrupted => Ok(Action::Stop),
            Input::End => Ok(Action::Quit),
        };
        let told = match action {
            Ok(Action::Quit) => break,
            Ok(action) => debugger.act(action, &mut signal),
            Err(message) => Ok(message),
        };
        match told {
            Ok(text) if text.is_empty() => {}
            Ok(text) => writeln!(out, "{text}")?,
            Err(error) if error.is_refusal() => writeln!(out, "{error}")?,
            Err(error) => return Err(error.into()),
        }
        out.flush()?;
    }
    writeln!(out, "{}", debugger.farewell()?)?;
    if signal.happened() { Err(signal.failure("")) } else { Ok(()) }
}
