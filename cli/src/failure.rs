//! The failure of a subcommand of `tmcl`, with its exit code.

use std::fmt;
use std::process::ExitCode;

/// The failure of a subcommand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The message for the user; exit code 1.
    Failed(String),
    /// The message for the user about arguments that contradict each other; exit code 2, as for other errors in the
    /// arguments, which end the program before any subcommand runs.
    Arguments(String),
    /// The failure has been reported to the user already; exit code 1.
    Reported,
}

impl Failure {
    /// The exit code of the program.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Failure::Failed(_) | Failure::Reported => ExitCode::FAILURE,
            Failure::Arguments(_) => ExitCode::from(2),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Failed(message) | Failure::Arguments(message) => f.write_str(message),
            Failure::Reported => Ok(()),
        }
    }
}

impl std::error::Error for Failure {}

/// An error of standard output ends the subcommand, because nobody reads the output any more.
impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Failure::Failed(format!("cannot write the output: {error}"))
    }
}
