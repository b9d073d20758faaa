//! `tmcl send`: commands in mnemonic form to a module, replies in words.

pub mod words;

use std::io::Write;
use std::time::Duration;

use clap::Args;
use tmcm::tmcl::{Command, binary, text};

use crate::failure::Failure;
use crate::link::{Link, Place};
use words::{Meaning, is_silent, meaning};

/// Send commands to a module and show its replies
///
/// LINK is where the module is: the path of a serial device (USB, an RS485 adapter, the serial port of `tmcl sim`),
/// tcp:HOST:PORT (the TCP port of `tmcl sim`), slcan:DEVICE or slcan:tcp:HOST:PORT (a serial CAN adapter), or sim for
/// a virtual module that lives only as long as this program.
///
/// A COMMAND is written as in the firmware manual, mnemonic first: "GAP 1, 0" or "MVP ABS, 0, 51200". Commands
/// without a mnemonic are four numbers: command, type, motor or bank, value.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// Where the module is: a serial device, tcp:HOST:PORT, slcan:DEVICE, or sim
    #[arg(value_name = "LINK", value_parser = Place::parse)]
    pub link: Place,

    /// The commands, each in quotes
    #[arg(value_name = "COMMAND", required = true, value_parser = command)]
    pub commands: Vec<Command>,

    /// The module's address on an RS485 bus, or its CAN identifier
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub address: u8,

    /// Speed of a serial device, for RS485; USB ignores it
    #[arg(long, value_name = "N", default_value_t = 9600, value_parser = clap::value_parser!(u32).range(1..))]
    pub baud: u32,

    /// How long to wait for each reply, in milliseconds
    #[arg(long, value_name = "MS", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=600_000))]
    pub timeout: u64,
}

const EXAMPLES: &str = "\
Examples:
  tmcl send /dev/ttyACM0 \"GAP 1, 0\"                   where the motor is
  tmcl send tcp:127.0.0.1:4140 \"ROR 0, 500\"           rotate right
  tmcl send slcan:/dev/ttyACM0 --address 3 \"GAP 1, 0\"   the module with CAN identifier 3
  tmcl send sim \"SAP 4, 0, 1500\" \"GAP 4, 0\"           two commands to a virtual module
  tmcl send /dev/ttyUSB0 --address 3 --baud 115200 \"136, 1\"   which module and firmware
The exit code is 1 if a command was not executed.";

fn command(line: &str) -> Result<Command, String> {
    text::parse(line).map_err(|error| error.to_string())
}

/// Sends the commands one after the other.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut link = Link::open(&options.link, options.baud, Duration::from_millis(options.timeout))?;
    let mut out = std::io::stdout().lock();
    let mut all_done = true;
    for command in &options.commands {
        let request = binary::encode_command(options.address, *command);
        match link.exchange(&request) {
            Ok(reply) => {
                let Meaning { text, done } = meaning(*command, &reply);
                writeln!(out, "{command}: {text}")?;
                all_done &= done;
            }
            Err(crate::link::LinkError::NoReply { bytes: 0 }) if is_silent(*command) => {
                writeln!(out, "{command}: no reply, as it should be")?;
            }
            Err(error) => return Err(Failure::Failed(format!("{command}: {error}"))),
        }
    }
    if all_done { Ok(()) } else { Err(Failure::Said) }
}
