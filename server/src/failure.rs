//! Why modules cannot run.

use std::error::Error;
use std::fmt;
use std::io;

/// Why modules cannot run, or cannot go on.
#[derive(Debug)]
pub enum Failure {
    /// Something that the options name cannot be used, or a module has stopped; the message for the user.
    Failed(String),
    /// The options contradict each other; the message for the user.
    Arguments(String),
    /// An output that the [console](crate::console::Console) has opened cannot be written.
    Output(io::Error),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Failed(message) | Failure::Arguments(message) => f.write_str(message),
            Failure::Output(error) => error.fmt(f),
        }
    }
}

impl Error for Failure {}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Failure::Output(error)
    }
}

impl From<tmcl_link::Error> for Failure {
    fn from(tmcl_link::Error(message): tmcl_link::Error) -> Self {
        Failure::Failed(message)
    }
}
