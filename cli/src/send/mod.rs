//! `tmcl send`: commands in mnemonic form to a module, replies in words.

pub mod words;

use std::io::Write;

use clap::Args;
use tmcm::tmcl::{Command, text};

use crate::conversation::{Conversation, Error, Reach};
use crate::failure::Failure;
use crate::link::LinkError;
use words::{Meaning, depends_on_unit_mode, meaning, needs_names, stays_unanswered};

/// Send commands to a module and show its replies
///
/// A COMMAND is written as in the firmware manual, mnemonic first: "GAP 1, 0" or "MVP ABS, 0, 51200". Commands without
/// a mnemonic are four numbers: command, type, motor or bank, value. To show the name of a parameter, the module is
/// asked once what it is; commands in numbers are answered in numbers, and nothing else is asked.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// The commands, each in quotes
    #[arg(value_name = "COMMAND", required = true, value_parser = Request::parse)]
    pub commands: Vec<Request>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl send /dev/ttyACM0 \"GAP 1, 0\"                           where the motor is
  tmcl send tcp:127.0.0.1:4140 \"ROR 0, 500\"                   rotate right
  tmcl send slcan:/dev/ttyACM0 --address 3 \"GAP 1, 0\"         the module with CAN identifier 3
  tmcl send sim \"SAP 4, 0, 1500\" \"GAP 4, 0\"                 two commands to a virtual module
  tmcl send /dev/ttyUSB0 --address 3 --baud 115200 \"136, 1\"   which module and firmware
The exit code is 1 if a command was not executed.";

/// A command as the user has typed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// The command.
    pub command: Command,
    /// True if it was typed in numbers alone, and is answered in numbers.
    pub numeric: bool,
}

impl Request {
    /// Reads a command in mnemonic or numeric form.
    pub(crate) fn parse(line: &str) -> Result<Self, String> {
        let command = text::parse(line).map_err(|error| error.to_string())?;
        Ok(Request { command, numeric: line.trim_start().starts_with(|c: char| c.is_ascii_digit()) })
    }
}

/// Sends the commands one after the other.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut module = Conversation::open(&options.reach)?;
    let mut out = std::io::stdout().lock();
    let mut all_done = true;
    for request in &options.commands {
        let Meaning { text, done } = ask(&mut module, *request)?;
        writeln!(out, "{}: {text}", request.command)?;
        all_done &= done;
    }
    if all_done { Ok(()) } else { Err(Failure::Reported) }
}

/// Sends a command and gives the reply in words.
pub(crate) fn ask(module: &mut Conversation, Request { command, numeric }: Request) -> Result<Meaning, Error> {
    match module.exchange(command) {
        Ok(reply) => {
            let plain = meaning(None, false, command, &reply);
            if numeric || !plain.done || !needs_names(command) {
                return Ok(plain);
            }
            let product = module.product()?;
            let in_chip = depends_on_unit_mode(product, command) && module.is_in_chip_units(command.motor)?;
            Ok(meaning(product, in_chip, command, &reply))
        }
        Err(LinkError::NoReply { bytes: 0 }) if stays_unanswered(command) => {
            Ok(Meaning { text: "no reply, as it should be".into(), done: true })
        }
        Err(error) => Err(Error::Link { command, error }),
    }
}
