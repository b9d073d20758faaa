//! The program `tmcl`: reads its arguments and runs one of the subcommands of the library `tmcl_cli`.

use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use tmcl_cli::failure::Failure;
use tmcl_cli::{
    asm, calc, completions, debug, disasm, dump, eds, help, load, manual, monitor, params, run, scan, send, shell, sim,
    tables, tell, testing, tune, version, world,
};

/// Virtual Trinamic stepper motor modules - {all} - and tools for TMCL, the language they speak.
///
/// Start a virtual module with `tmcl sim` and point your host software at the serial port or TCP port that it prints.
/// Talk to a module - virtual or real - with the other commands.
#[derive(Parser, Debug)]
#[command(name = "tmcl", version = version::SHORT, long_version = version::LONG.as_str(), max_term_width = 100, after_long_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,

    /// When errors, warnings and changed values have colours
    #[arg(long, value_name = "WHEN", global = true, value_enum, default_value_t, display_order = 1000)]
    color: tell::Colours,
}

const EXAMPLES: &str = "\
Examples:
  tmcl sim --tcp 127.0.0.1:4140                  a virtual module, in another terminal
  tmcl send tcp:127.0.0.1:4140 \"ROR 0, 500\"     its motor turns
  tmcl asm stage.tmc                             is the program right?
  tmcl debug tcp:127.0.0.1:4140 stage.tmc        try it step by step
  tmcl load /dev/ttyACM0 stage.tmc --autostart   into a real module, to be run after power-up
  tmcl run stage.tmc --product 3110              what would it do on a module with three axes?
  tmcl test stage.txt                            does it do what the scenarios in this file say?
Each command has examples of its own: tmcl load --help";

#[derive(Subcommand, Debug)]
enum Command {
    Sim(tmcl_server::options::Options),
    World(world::Options),
    Send(send::Options),
    Shell(shell::Options),
    Scan(scan::Options),
    Monitor(monitor::Options),
    Params(params::Options),
    Tune(tune::Options),
    Calc(calc::Options),
    Asm(asm::Options),
    Disasm(disasm::Options),
    Run(run::Options),
    Test(testing::Options),
    Load(load::Options),
    Dump(dump::Options),
    Debug(debug::Options),
    Eds(eds::Options),
    Tables(tables::Options),
    Completions(completions::Options),
    Manual(manual::Options),
}

/// The same command, where a number below 0 is a value and no option: whether it can be one there is for the reader of
/// that value to say.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|argument| match argument.get_action().takes_values() {
        true => argument.allow_negative_numbers(true),
        false => argument,
    });
    command.mut_subcommands(with_negative_numbers)
}

/// The command line of the program.
fn command() -> clap::Command {
    help::told(Arguments::command())
}

fn main() -> ExitCode {
    let matches = match with_negative_numbers(command()).try_get_matches() {
        Ok(matches) => matches,
        Err(version) if version.kind() == ErrorKind::DisplayVersion => {
            // A closed standard output does not want it.
            let _ = write!(tell::out(), "{}", version::with_commit(&version.to_string()));
            return ExitCode::SUCCESS;
        }
        Err(error) => error.exit(),
    };
    let Arguments { command, color } = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    color.choose();
    let done = match command {
        Command::Sim(options) => sim::run(&options),
        Command::Send(options) => send::run(&options),
        Command::Shell(options) => shell::run(&options),
        Command::Asm(options) => asm::run(&options),
        Command::Disasm(options) => disasm::run(&options),
        Command::Params(options) => params::run(&options),
        Command::Monitor(options) => monitor::run(&options),
        Command::Scan(options) => scan::run(&options),
        Command::Run(options) => run::run(&options),
        Command::Test(options) => testing::run(&options),
        Command::Load(options) => load::run(&options),
        Command::Dump(options) => dump::run(&options),
        Command::Debug(options) => debug::run(&options),
        Command::Calc(options) => calc::run(&options),
        Command::Eds(options) => eds::run(&options),
        Command::Tables(options) => tables::run(&options),
        Command::Completions(options) => completions::run(&options, self::command()),
        Command::Manual(options) => manual::run(&options, self::command()),
        Command::World(options) => world::run(&options),
        Command::Tune(options) => tune::run(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if let Some(message) = failure.message() {
                if matches!(failure, Failure::Interrupted { .. }) && std::io::stderr().is_terminal() {
                    // In place of the ^C that a terminal shows.
                    let _ = tell::err().redraw("");
                }
                // A closed standard error does not change the exit code.
                let _ = tell::error(message);
            }
            failure.exit_code()
        }
    }
}
