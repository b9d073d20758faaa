//! `tmcl tables`: parameters of a product, and objects of the CANopen firmware, as JSON.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use tmcl_tools::product::{self, Product};
use tmcl_tools::tables;

use crate::failure::Failure;
use crate::files::STANDARD;
use crate::output::Output;

/// Write the parameters of a product, or the objects of the CANopen firmware, as JSON for other programs
///
/// Of each parameter: number, name, ranges, unit, default, and whether it is stored. `tmcl params list` shows the
/// values of a module as well, and `tmcl eds` has the objects for masters.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The product of the parameters
    #[arg(value_name = "PRODUCT", default_value = product::USUAL, value_parser = product::named)]
    pub product: Product,

    /// The objects of the TMCM-1140 with the CANopen firmware in place of parameters
    #[arg(long, conflicts_with = "product")]
    pub objects: bool,

    /// Where the table goes; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = STANDARD)]
    pub output: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  tmcl tables 6110                       the parameters of a TMCM-6110
  tmcl tables 1140 -o parameters.json    into a file
  tmcl tables --objects                  the objects of the CANopen firmware";

/// Writes the table.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut output = Output::open("", &options.output)?;
    let text = if options.objects { tables::objects() } else { tables::parameters(options.product) };
    output.write_all(text.as_bytes())?;
    output.finish()
}
