//! `tmcl eds`: the objects of the CANopen firmware as a file for masters and their tools.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use tmcl_tools::eds::text;

use crate::failure::Failure;
use crate::files::STANDARD;
use crate::output::Output;

/// Write the electronic data sheet (EDS) of the TMCM-1140 with the CANopen firmware
///
/// Masters and their tools learn from an EDS which objects a node has (CiA 306). The COB-IDs in it hold for every node
/// ID; with --node-id they are those of one node, and the file is one of that node (DCF).
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The node ID that the file is for; all if it is left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=127))]
    pub node_id: Option<u8>,

    /// Where the file goes; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = STANDARD)]
    pub output: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  tmcl eds -o tmcm1140.eds                 for every node ID
  tmcl eds --node-id 5 -o axis5.dcf        for node 5
  tmcl eds | grep -A 2 '^\\[60'             what the objects of the drive are called";

/// Writes the file.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut output = Output::open("", &options.output)?;
    output.write_all(text(options.node_id).as_bytes())?;
    output.finish()
}
