//! How a command of the program ends when it does not succeed.

use std::fmt;
use std::process::ExitCode;

/// What went wrong, told to a person, and the exit code that goes with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The program was called well but could not do it: exit code 1. (Calls it does not understand end with 2,
    /// before this.)
    Failed(String),
    /// All has been said already: exit code 1.
    Said,
}

impl Failure {
    /// The exit code of the program.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Failure::Failed(_) | Failure::Said => ExitCode::FAILURE,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Failed(message) => f.write_str(message),
            Failure::Said => Ok(()),
        }
    }
}

impl std::error::Error for Failure {}

/// Standard output that nobody reads any more ends the program.
impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Failure::Failed(format!("cannot write the output: {error}"))
    }
}
