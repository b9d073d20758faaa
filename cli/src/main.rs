//! The program `tmcl`.

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tmcl_cli::failure::Failure;
use tmcl_cli::{asm, debug, disasm, load, monitor, params, scan, send, sim};

/// A virtual Trinamic TMCM-1140 stepper motor module, and tools for TMCL, the language it speaks.
///
/// Start a virtual module with `tmcl sim` and point your host software at the serial port or TCP port that
/// it prints; talk to a module - virtual or real - with `tmcl send`. `tmcl asm` assembles TMCL programs.
#[derive(Parser, Debug)]
#[command(name = "tmcl", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    Sim(sim::Options),
    Send(send::Options),
    Asm(asm::Options),
    Disasm(disasm::Options),
    Params(params::Options),
    Monitor(monitor::Options),
    Scan(scan::Options),
    Load(load::Options),
    Debug(debug::Options),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Sim(options) => sim::run(&options),
        Command::Send(options) => send::run(&options),
        Command::Asm(options) => asm::run(&options),
        Command::Disasm(options) => disasm::run(&options),
        Command::Params(options) => params::run(&options),
        Command::Monitor(options) => monitor::run(&options),
        Command::Scan(options) => scan::run(&options),
        Command::Load(options) => load::run(&options),
        Command::Debug(options) => debug::run(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if failure != Failure::Said {
                // Where standard error is closed there is nobody to tell.
                let _ = writeln!(std::io::stderr(), "tmcl: {failure}");
            }
            failure.exit_code()
        }
    }
}
