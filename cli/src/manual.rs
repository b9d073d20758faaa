//! `tmcl manual`: a manual page for each command.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use clap_mangen::Man;
use tmcl_link::wording;

use crate::draft::Draft;
use crate::failure::Failure;

/// Write manual pages of all commands into a folder, for `man tmcl` and `man tmcl-sim`
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The folder, which is made if there is none
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  tmcl manual ~/.local/share/man/man1    where man looks for pages of this user
  tmcl manual pages                      for somebody else";

/// Writes the pages of `program`, each in one piece.
pub fn run(options: &Options, mut program: clap::Command) -> Result<(), Failure> {
    let made = fs::create_dir_all(&options.folder);
    made.map_err(|error| {
        Failure::Failed(format!("cannot make {}: {}", options.folder.display(), wording::of(&error)))
    })?;
    program.build();
    pages(&options.folder, &program)
}

/// Writes the page of a command, and those of the commands below it.
fn pages(folder: &Path, command: &clap::Command) -> Result<(), Failure> {
    // The name of a command has those above it in front, as pages of man have.
    let name = command.get_display_name().unwrap_or(command.get_name());
    let mut page = Vec::new();
    Man::new(command.clone()).title(name.to_uppercase()).render(&mut page)?;
    Draft::begin(&folder.join(format!("{name}.1")))?.finish(&page)?;
    let mut below = command.get_subcommands().filter(|command| command.get_name() != "help");
    below.try_for_each(|command| pages(folder, command))
}
