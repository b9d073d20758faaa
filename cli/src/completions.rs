//! `tmcl completions`: what lets a shell complete the commands and options of `tmcl`.

use std::io::Write;

use clap::Args;
use clap_complete::Shell;

use crate::failure::Failure;

/// Let a shell complete commands, options and file names of tmcl
///
/// What is printed goes to a file that the shell reads when it starts.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub shell: Shell,
}

const EXAMPLES: &str = "\
Examples:
  tmcl completions bash > ~/.local/share/bash-completion/completions/tmcl
  tmcl completions zsh > ~/.zfunc/_tmcl
      with fpath+=~/.zfunc before compinit in ~/.zshrc
  tmcl completions fish > ~/.config/fish/completions/tmcl.fish";

/// Prints the completions of `program`.
pub fn run(options: &Options, mut program: clap::Command) -> Result<(), Failure> {
    let name = program.get_name().to_owned();
    let mut text = Vec::new();
    clap_complete::generate(options.shell, &mut program, name, &mut text);
    let mut out = std::io::stdout().lock();
    out.write_all(&text)?;
    Ok(out.flush()?)
}
