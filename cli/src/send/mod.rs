//! `tmcl send`: commands in mnemonic form to a module, replies in words.

use std::io::Write;

use clap::Args;
use tmcm::tmcl::{Command, Status};
use tmcm_sim::wire::stays_unanswered;
use tmcm_sim::wire::words::{depends_on_unit_mode, needs_names};
use tmcm_sim::wire::{Meaning, Reply};

use crate::asm::check::no_such_motor;
use crate::conversation::{Conversation, Error, Reach};
use crate::failure::Failure;
use crate::link::LinkError;
use crate::product::Product;
use crate::request::{Answered, Request, Typed};
use crate::tell;

/// Send commands to a module and show its replies
///
/// A COMMAND is written as in the firmware manual, mnemonic first: "GAP 1, 0" or "MVP ABS, 0, 51200". Commands without
/// a mnemonic are four numbers: command, type, motor or bank, value. In place of numbers there may be the names that `tmcl
/// asm --names` shows, and expressions of them: "SAP APMaxPositioningSpeed, Motor0, 2 * 500". To know a name, or to show
/// that of a parameter, the module is asked once what it is; commands in numbers are answered in numbers, and nothing
/// else is asked.
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
    let mut module = Conversation::open(&options.reach)?;
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

/// Sends a command and prints the value of the reply. What is no value is told on standard error; true if there is nothing
/// to tell.
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

/// Sends a command and gives the reply in words. Of a value, motor or bank out of range that says which motor, bank or set of
/// axes the module does not have, if that is what is wrong.
pub(crate) fn ask(module: &mut Conversation, request: Request) -> Result<Meaning, Error> {
    let reply = reply_to(module, request)?;
    let mut meaning = Meaning::from(reply.as_ref());
    let is_out_of_range = reply.is_some_and(|reply| reply.status == Some(Status::InvalidValue as u8));
    let why = |product: Product| no_such_motor(product.spec(), request.command);
    // What the module is makes a difference only where one of the products does not have it.
    if is_out_of_range
        && Product::ALL.into_iter().any(|product| why(product).is_some())
        && let Some(why) = module.product()?.and_then(why)
    {
        meaning.text = format!("{}: {why}", meaning.text);
    }
    Ok(meaning)
}

/// Sends a command and gives the reply; `None` for a command that modules execute without a reply.
pub(crate) fn reply_to(
    module: &mut Conversation,
    Request { command, numeric }: Request,
) -> Result<Option<Reply>, Error> {
    match module.exchange(command) {
        Ok(telegram) => {
            let plain = Reply::read(None, false, command, &telegram);
            if numeric || !plain.done() || !needs_names(command) {
                return Ok(Some(plain));
            }
            let (product, in_chip) = units(module, command)?;
            Ok(Some(Reply::read(product, in_chip, command, &telegram)))
        }
        Err(LinkError::NoReply { bytes: 0 } | LinkError::Others { .. }) if stays_unanswered(command) => Ok(None),
        Err(error) => Err(Error::Link { command, error }),
    }
}

/// The unit of the values of a command, and the name of what they are of; empty where there is none.
pub(crate) fn unit_and_name(
    module: &mut Conversation,
    command: Command,
) -> Result<(&'static str, Option<String>), Error> {
    let (product, in_chip) = units(module, command)?;
    let Reply { unit, name, .. } = Reply::of_value(product, in_chip, command, 0);
    Ok((unit, name))
}

/// What the module is, and whether the values of the command are in units of its chip.
fn units(module: &mut Conversation, command: Command) -> Result<(Option<Product>, bool), Error> {
    let product = module.product()?;
    Ok((product, depends_on_unit_mode(product, command) && module.is_in_chip_units(command.motor)?))
}
