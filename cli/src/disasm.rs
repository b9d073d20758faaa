//! `tmcl disasm`: the source of an assembled program.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use tmcl_tools::disasm::source;
use tmcl_tools::product::{self, Product};
use tmcl_tools::program::address;

use crate::failure::Failure;
use crate::program::read_commands;
use crate::tell;

/// Show an assembled TMCL program as source
///
/// FILE is what `tmcl asm` makes, or the vendor's assembler: eight bytes for each command. The source that is printed
/// assembles to the same bytes again. Labels are named after their addresses, and parameters are named in comments.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The assembled program; - is standard input
    #[arg(value_name = "FILE")]
    pub program: PathBuf,

    /// The module that the program is for: {numbers}
    #[arg(long, value_name = "NAME", default_value = product::USUAL, value_parser = product::named)]
    pub product: Product,

    /// Address in program memory that the program was assembled for: that of `tmcl asm --origin`
    #[arg(long, value_name = "ADDRESS", default_value_t = 0, value_parser = address)]
    pub origin: u16,
}

const EXAMPLES: &str = "\
Examples:
  tmcl disasm stage.bin
  tmcl disasm stage.bin > again.tmc && tmcl asm again.tmc
      stage.bin and again.bin are the same
  tmcl asm examples/to_and_fro.tmc -o - | tmcl disasm -
      what the assembler has made of a source";

/// Prints the source of a program.
pub fn run(options: &Options) -> Result<(), Failure> {
    let commands = read_commands(&options.program, Some(options.product))?;
    let mut out = tell::out();
    out.write_all(source(&commands, options.origin, Some(options.product)).as_bytes())?;
    Ok(out.flush()?)
}
