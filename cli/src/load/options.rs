//! The arguments of `tmcl load`.

use clap::Args;
use tmcl_tools::program::address;

use crate::program::ProgramThere;

/// Load a TMCL program into a module, where it stays
///
/// FILE is a source, which is assembled first, or an assembled program: what `tmcl asm` makes, or the vendor's
/// assembler. A program that runs in the module is stopped first; a motor that it has set in motion goes on turning.
/// Nothing starts unless --run is given.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module and its program
    #[command(flatten)]
    pub program: ProgramThere,

    /// Read the program back and compare
    #[arg(long)]
    pub verify: bool,

    /// Start it, at the address it is loaded to
    #[arg(long)]
    pub run: bool,

    /// Let the module start the program at address 0 by itself after power-up (global parameter 77)
    #[arg(long)]
    pub autostart: bool,

    /// Address in program memory of the first command; the rest of the memory stays as it is
    ///
    /// A source is assembled for that address. An assembled program is put there as it is: it has to have been
    /// assembled for it, by `tmcl asm --origin`.
    #[arg(long, value_name = "ADDRESS", default_value_t = 0, value_parser = address)]
    pub at: u16,

    /// Load it again whenever FILE, or a file that it includes, is saved; until Ctrl-C
    ///
    /// While a source has errors the module keeps the program that it has. With --run each new program is started.
    #[arg(long)]
    pub watch: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl load sim examples/to_and_fro.tmc --verify --run
      load it, compare it, start it
  tmcl load /dev/ttyACM0 stage.tmc --autostart
      to be run from the next power-up on
  tmcl load /dev/ttyACM0 routine.tmc --at 50
      beside the program that is there
  tmcl load /dev/ttyACM0 stage.tmc --run --watch
      and again with each change
  tmcl send /dev/ttyACM0 \"129, 1, 0, 50\"
      runs such a routine";
