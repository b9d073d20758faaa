//! `tmcl send`: commands in mnemonic form to a module, replies in words.

use std::io::Write;

use clap::Args;
use tmcl_tools::conversation::{Conversation, Error};
use tmcl_tools::replies::{ask, reply_to};
use tmcl_tools::request::{Answered, Request, Typed};
use tmcm::tmcl::Command;
use tmcm_sim::wire::{Meaning, Reply};

use crate::failure::Failure;
use crate::reach::Reach;
use crate::tell;

/// Send commands to a module and show its replies
///
/// A COMMAND is written as in the firmware manual, mnemonic first: "GAP 1, 0" or "MVP ABS, 0, 51200". Commands without
/// a mnemonic are four numbers: command, type, motor or bank, value. In place of numbers there may be the names that
/// `tmcl asm --names` shows, and expressions of them: "SAP APMaxPositioningSpeed, Motor0, 2 * 500". To know a name, or
/// to show that of a parameter, the module is asked once what it is. Commands in numbers are answered in numbers, and
/// nothing else is asked.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// The commands, each in quotes
    #[arg(value_name = "COMMAND", required = true, value_parser = Typed::parse)]
    pub commands: Vec<Typed>,

    /// Show the value of each reply and nothing else, one a line; what is refused is told on standard error
    #[arg(long, conflicts_with = "json")]
    pub value: bool,

    /// Show each reply as an object of JSON, one a line: command, status, meaning, value, unit, name
    ///
    /// What a reply does not have is left out. A version string, or a command read from program memory, is in "text".
    /// Where no reply came, or another one than that to the command, "error" says so.
    #[arg(long)]
    pub json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl send /dev/ttyACM0 \"GAP 1, 0\"                           where the motor is
  tmcl send tcp:127.0.0.1:4140 \"ROR 0, 500\"                   rotate right
  tmcl send slcan:/dev/ttyACM0 --address 3 \"GAP 1, 0\"         the module with CAN identifier 3
  tmcl send sim \"SAP 4, 0, 1500\" \"GAP 4, 0\"                 two commands to a virtual module
  tmcl send sim \"GAP APMaxCurrent, Motor0\"                 by the name of the parameter
  tmcl send sim --value \"GIO 8, 1\"                          for scripts: the number alone
  tmcl send sim --log-telegrams - \"MST 0\"                     the bytes of request and reply, too
  tmcl send /dev/ttyUSB0 --address 3 --baud 115200 \"136, 1\"   which module and firmware
The exit code is 1 if a command was not executed.";

/// Sends the commands one after the other.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut module = options.reach.open()?;
    let product = match options.commands.iter().any(Typed::has_names) {
        true => module.product()?,
        false => None,
    };
    // Nothing is sent before all commands are read.
    let requests: Result<Vec<Request>, String> = options.commands.iter().map(|typed| typed.request(product)).collect();
    let mut out = tell::out();
    let mut all_done = true;
    for request in requests.map_err(Failure::Arguments)? {
        all_done &= if options.value {
            show_value(&mut out, &mut module, request.command)?
        } else if options.json {
            show_json(&mut out, &mut module, request)?
        } else {
            let Meaning { text, done } = ask(&mut module, request)?;
            writeln!(out, "{}: {text}", request.command)?;
            done
        };
    }
    out.flush()?;
    if all_done { Ok(()) } else { Err(Failure::Reported) }
}

/// Sends a command and prints the value of the reply. What is no value is told on standard error; true if there is
/// nothing to tell.
fn show_value(out: &mut impl Write, module: &mut Conversation, command: Command) -> Result<bool, Failure> {
    // The value alone needs no names, so the module is not asked for them.
    let reply = reply_to(module, Request { command, numeric: true })?;
    let told = match reply {
        None => return Ok(true),
        Some(Reply { value: Some(value), .. }) => {
            writeln!(out, "{value}")?;
            return Ok(true);
        }
        Some(reply) if reply.done() => format!("{}; the reply has no value", Meaning::from(&reply).text),
        Some(reply) => Meaning::from(&reply).text,
    };
    // A closed standard error does not end the program.
    let _ = tell::error(format_args!("{command}: {told}"));
    Ok(false)
}

/// Sends a command and prints the reply as JSON, or that there is none. True if the command has been executed.
fn show_json(out: &mut impl Write, module: &mut Conversation, request: Request) -> Result<bool, Failure> {
    let command = request.command.to_string();
    let (told, done) = match reply_to(module, request) {
        Ok(reply) => {
            let done = reply.as_ref().is_none_or(Reply::done);
            (Answered { command, reply, error: None }, Ok(done))
        }
        Err(error) => {
            let reason = match &error {
                Error::Link { error, .. } => error.to_string(),
                error => error.to_string(),
            };
            (Answered { command, reply: None, error: Some(reason) }, Err(error))
        }
    };
    serde_json::to_writer(&mut *out, &told).map_err(std::io::Error::from)?;
    writeln!(out)?;
    Ok(done?)
}
