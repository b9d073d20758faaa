//! `tmcl dump`: the program in a module as source.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use tmcl_link::EndSignal;
use tmcl_tools::conversation::Identity;
use tmcl_tools::disasm;
use tmcl_tools::dump::{heading, read, summary, trim};
use tmcl_tools::program::{address, is_readable};

use crate::failure::Failure;
use crate::output::Output;
use crate::progress;
use crate::reach::Reach;
use crate::tell;

/// Read the program in a module back as source
///
/// The source assembles to the same commands again. Labels are named after their addresses, and parameters are named in
/// comments; names and comments that the program had are not in the module. All of program memory is read, up to the
/// last command that is not empty: routines that only a host starts may lie anywhere. A comment says where the program
/// that begins at address 0 ends. A program that runs is not disturbed.
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
    let mut module = options.reach.open()?;
    let identity = module.identity()?;
    let addresses = addresses(options, identity)?;
    if !is_readable(&mut module)? {
        let message = "the program cannot be read, it is protected (global parameter 81); \"SGP 81, 0, 0\" lifts the \
                       protection, and erases the program";
        return Err(Failure::Failed(message.into()));
    }
    let mut commands = read(&mut module, addresses, &signal, &mut progress::bar())?;
    if options.count.is_none() {
        trim(&mut commands);
    }
    let text = heading(&commands, options.at, identity) + &disasm::source(&commands, options.at, identity.product);
    let mut output = Output::open("-o", &options.output)?;
    output.write_all(text.as_bytes())?;
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
