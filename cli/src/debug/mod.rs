//! `tmcl debug`: a program in a module, step by step.
//!
//! TMCL has no breakpoints. The host lets the module execute one command at a time, and compares the program counter
//! with its own list of breakpoints.

mod completion;

use std::io::Write;
use std::path::Path;

use clap::Args;
use completion::Completion;
use tmcl_link::EndSignal;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::debug::state::Told;
use tmcl_tools::debug::{Action, Around, Debugger, Trouble, words};
use tmcl_tools::product::Product;
use tmcl_tools::program::{Program, download, is_readable, verify};
use tmcl_tools::stop::Stop;
use tmcm::tmcl::Opcode;

use crate::failure::{Ended, Failure};
use crate::files::is_standard;
use crate::program::{ProgramThere, read_program};
use crate::progress;
use crate::tell::{self, Tone};
use crate::terminal::editor::{Editor, Input};

/// Run a TMCL program in a module step by step, with breakpoints
///
/// Loads FILE, a source or an assembled program as for `tmcl load`, and waits at its first command. Then it takes
/// commands, one a line, from the terminal or from a pipe; `help` lists them. With a source (.tmc) there are labels,
/// lines and names, and source lines are shown beside the commands. The motors really move. While there are breakpoints
/// the program runs as fast as the link allows, some hundred commands a second. Ctrl-C halts a program that runs.
///
/// On a terminal lines can be edited, the arrow keys bring earlier ones back, Tab completes names, and an empty line
/// repeats the last command. A pipe is a script, and its empty lines do nothing. The first line that cannot be carried
/// out ends it, with exit code 1, because what follows was meant for another state. The module stays as it is then.
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
  tmcl debug sim examples/stall_homing.tmc --world examples/stall_homing.toml
  printf 'break MainLoop\\ncontinue\\naxes\\n' | tmcl debug sim examples/main_loop.tmc
After the prompt:
  break Back if acc > 5          stop before the label Back, but only then
  print APActualPosition         a parameter by its name; watch shows it at each stop
  set variable 10 = 3            a user variable; set acc 3 is for the accumulator";

/// Debugs until the user quits, and prints the state in which the module is left.
pub fn run(options: &Options) -> Result<(), Failure> {
    let file = &options.program.file;
    if is_standard(file) {
        let message = "the program has to be in a file: standard input has the commands of the debugger";
        return Err(Failure::Arguments(message.into()));
    }
    // Until the link is open, Ctrl-C ends the program at once: looking for a host may take long.
    let mut module = options.program.reach.open()?;
    let signal = EndSignal::watch()?;
    let program = read_program(file, module.product()?)?;
    if options.attach {
        // A program that is protected from being read cannot be compared with the file.
        if is_readable(&mut module)? {
            verify(&mut module, &program, 0, &signal, &mut progress::bar())?;
        }
    } else {
        download(&mut module, &program, 0, &signal, &mut progress::bar())?;
        module.control(Opcode::ResetApplication, 0, 0)?;
    }
    let mut debugger = Debugger::new(&mut module, file.clone(), program)?;
    let mut input = Editor::open(Completion { names: debugger.names() })?;
    let done = converse(&mut debugger, &mut module, &mut input, &signal);
    if let Err(Failure::Failed(_) | Failure::Closed) = done {
        return done;
    }
    match debugger.farewell(&mut module) {
        Ok(farewell) => writeln!(tell::out(), "{}", words::farewell(&farewell))?,
        Err(error) if done.is_ok() => return Err(error.into()),
        Err(_) => {}
    }
    done
}

/// Reads a program again that is in a module.
fn reread(file: &Path, product: Option<Product>) -> Result<Program, String> {
    read_program(file, product).map_err(|failure| match failure {
        Failure::Reported => "the module still has the program as it was; mend the file and reload".into(),
        failure => format!("{failure}; the module still has the program as it was"),
    })
}

/// Takes commands until there are no more, and shows what comes of them. Lines are counted from 1; what is told before
/// the first one is where the program is.
fn converse(
    debugger: &mut Debugger,
    module: &mut Conversation,
    input: &mut Editor<Completion>,
    signal: &EndSignal,
) -> Result<(), Failure> {
    let mut out = tell::out();
    let is_terminal = input.is_terminal();
    let prompt = if is_terminal { "(tmcl) " } else { "" };
    let mut last = None;
    let mut told = Ok(debugger.whereabouts(module)?);
    for number in 0_u64.. {
        match told {
            Ok(told) => {
                let text = words::text(&told);
                if !text.is_empty() {
                    writeln!(out, "{text}")?;
                }
                for change in words::changes(&told) {
                    out.toned("", Tone::Changed, &change, "\n")?;
                }
            }
            Err(Trouble::Mistake(message)) if is_terminal => writeln!(out, "{message}")?,
            Err(Trouble::Mistake(message)) => {
                out.flush()?;
                // A closed standard error does not change the exit code.
                let _ = tell::error(format_args!("line {number}: {message}"));
                return Err(Failure::Reported);
            }
            Err(Trouble::Failure(failure)) => return Err(failure.into()),
        }
        out.flush()?;
        if signal.happened() {
            if !is_terminal || !signal.is_interrupt() {
                return Err(signal.failure(""));
            }
            signal.forget();
        }
        let action = match input.line(prompt, signal)? {
            Input::Line(line) if !line.trim().is_empty() => Action::parse(&line).map(Some),
            Input::Line(_) => Ok(last.clone().filter(|_| is_terminal)),
            Input::Interrupted => Ok(Some(Action::Stop)),
            Input::End => break,
        };
        told = match action {
            Ok(Some(Action::Quit)) => break,
            Ok(Some(action)) => {
                last = Some(action.again());
                let mut around = Around { stop: signal, read: &mut reread, progress: &mut progress::bar() };
                debugger.act(module, action, &mut around)
            }
            Ok(None) => Ok(Told::Nothing),
            Err(message) => Err(message.into()),
        };
        if let (Ok(Told::Reloaded { .. }), Some(completion)) = (&told, input.completion()) {
            completion.names = debugger.names();
        }
    }
    if signal.happened() { Err(signal.failure("")) } else { Ok(()) }
}
