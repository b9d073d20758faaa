//! Programs that users name: files, and modules that are to have them.

mod file;

pub use file::{is_source, read_commands, read_program, read_watched};

use std::path::PathBuf;

use clap::Args;

use crate::reach::Reach;

/// A module and the program it is to have, as they are written on the command line.
#[derive(Args, Debug)]
pub struct ProgramThere {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// The program: a source, whose name ends in .tmc, or an assembled program; - is standard input, for either
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}
