//! `tmcl dump`: the program in a module as source.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use tmcm::tmcl::{Command, Status};

use crate::conversation::{Conversation, Identity, Reach};
use crate::disasm;
use crate::failure::Failure;
use crate::output::Output;
use crate::product::short;
use crate::program::{address, end, goes_on, is_readable};
use crate::progress::Progress;
use crate::signal::EndSignal;
use crate::tell;

/// Read the program in a module back as source
///
/// The source assembles to the same commands again. Labels are named after their addresses, and parameters are named in
/// comments; names and comments that the program had are not in the module. All of program memory is read, up to the last
/// command that is not empty: routines that only a host starts may lie anywhere. A comment says where the program that
/// begins at address 0 ends. A program that runs is not disturbed.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// Where the source goes; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = crate::files::STANDARD)]
    pub output: PathBuf,

    /// Address of the first command that is read
    #[arg(long, value_name = "ADDRESS", default_value_t = 0, value_parser = address)]
    pub at: u16,

    /// Read so many commands, and no more; a whole memory takes two minutes on RS485 with 9600 bit/s
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub count: Option<u16>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl dump /dev/ttyACM0
      the program in the module at the USB port
  tmcl dump /dev/ttyACM0 -o backup.tmc
      into a file, which tmcl load puts into a module again
  tmcl dump /dev/ttyUSB0 --at 0 --count 20
      the first twenty commands, on RS485
  tmcl dump /dev/ttyACM0 | tmcl asm - -o backup.bin
      as an assembled program";

/// Most commands that a module can have: as many as there are addresses.
const MOST: usize = 1 << 16;

/// Reads the program in a module and writes its source.
pub fn run(options: &Options) -> Result<(), Failure> {
    let signal = EndSignal::watch()?;
    let mut module = Conversation::open(&options.reach)?;
    let identity = module.identity()?;
    let addresses = addresses(options, identity)?;
    if !is_readable(&mut module)? {
        let message = "the program cannot be read, it is protected (global parameter 81); \"SGP 81, 0, 0\" lifts the \
                       protection, and erases the program";
        return Err(Failure::Failed(message.into()));
    }
    let mut commands = read(&mut module, addresses, &signal)?;
    if options.count.is_none() {
        trim(&mut commands);
    }
    let text = heading(&commands, options.at, identity) + &disasm::source(&commands, options.at, identity.product);
    let mut output = Output::open("-o", &options.output)?;
    output.write(text.as_bytes())?;
    let summary = format!("{}: {}", output.name(), summary(&commands, options.at));
    let is_standard = output.is_standard();
    output.finish()?;
    if is_standard {
        // A closed standard error does not end the program.
        let _ = writeln!(tell::err(), "tmcl: {summary}");
        return Ok(());
    }
    Ok(writeln!(tell::out(), "{summary}")?)
}

/// The addresses to read; of a product that is not known, as many as a module can have.
fn addresses(options: &Options, identity: Identity) -> Result<std::ops::Range<usize>, Failure> {
    let at = usize::from(options.at);
    let size = identity.product.map_or(MOST, |product| product.spec().commands.into());
    let end = options.count.map_or(size, |count| at + usize::from(count));
    if at >= size || end > size {
        let wanted = match options.count {
            Some(count) => format!("--at {at} --count {count}"),
            None => format!("--at {at}"),
        };
        return Err(Failure::Failed(format!("{wanted}: program memory ends at {}", size.saturating_sub(1))));
    }
    Ok(at..end)
}

/// Reads the commands at some addresses, or up to the end of program memory, where a module refuses to go on.
fn read(
    module: &mut Conversation,
    addresses: std::ops::Range<usize>,
    signal: &EndSignal,
) -> Result<Vec<Command>, Failure> {
    let mut progress = Progress::new("reading the program", addresses.len());
    let mut commands = Vec::new();
    for address in addresses {
        if signal.happened() {
            return Err(signal.failure("interrupted; nothing has been written"));
        }
        let Ok(address) = u16::try_from(address) else { break };
        match module.memory(address) {
            Ok(command) => commands.push(command),
            Err(error) if error.is(Status::InvalidValue) && !commands.is_empty() => break,
            Err(error) => return Err(error.into()),
        }
        progress.reach(commands.len());
    }
    Ok(commands)
}

/// Takes the empty commands at the end away, but for one that ends the program.
fn trim(commands: &mut Vec<Command>) {
    let is_empty = |command: &Command| *command == Command::default();
    let used = commands.iter().rposition(|command| !is_empty(command)).map_or(0, |last| last + 1);
    let ends = commands.get(..used).and_then(<[Command]>::last).is_none_or(|last| !goes_on(last));
    commands.truncate(if ends { used } else { used + 1 });
}

/// What the source is and how it becomes a program again.
fn heading(commands: &[Command], at: u16, identity: Identity) -> String {
    let number = identity.number;
    let version = identity.version.map_or_else(String::new, |_| format!(" ({identity})"));
    let mut call = "tmcl asm".to_string();
    if let Some(product) = identity.product {
        call += &format!(" --product {}", short(product));
    }
    if at > 0 {
        call += &format!(" --origin {at}");
    }
    format!(
        "// TMCM-{number}{version}: {}\n// Assembled by {call} it has the same commands again.\n",
        summary(commands, at)
    )
}

/// How many commands there are and where.
fn summary(commands: &[Command], at: u16) -> String {
    let Some(last) = commands.len().checked_sub(1) else { return "program memory is empty".into() };
    let at = usize::from(at);
    let plural = if last == 0 { "" } else { "s" };
    let mut text = format!("{} command{plural}, addresses {at} to {}", commands.len(), at + last);
    let end = end(commands, at);
    if end < commands.len() {
        text += &format!("; the program that begins at {at} ends at {}", at + end - 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_empty_at_the_end_is_left_out_unless_it_ends_the_program() {
        let trimmed = |text: &str| {
            let mut commands: Vec<Command> = text.lines().map(|line| tmcm::tmcl::text::parse(line).unwrap()).collect();
            trim(&mut commands);
            commands.len()
        };
        assert_eq!(trimmed("MST 0\nSTOP\n0, 0, 0, 0\n0, 0, 0, 0"), 2);
        assert_eq!(trimmed("MST 0\n0, 0, 0, 0\n0, 0, 0, 0"), 2);
        assert_eq!(trimmed("0, 0, 0, 0\nMST 0\n0, 0, 0, 0\nJA 1\n0, 0, 0, 0"), 4);
        assert_eq!(trimmed("MST 0\nMST 0"), 2);
        assert_eq!((trimmed("0, 0, 0, 0\n0, 0, 0, 0"), trimmed("")), (0, 0));
    }
}
