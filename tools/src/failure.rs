//! Why a job has ended before its time.

use std::fmt;

/// Why a job has ended before its time.
#[derive(Debug)]
pub enum Failure {
    /// The job cannot be done: the message for the user.
    Failed(String),
    /// The request contradicts itself, or is no number of the module: the message for the user.
    Arguments(String),
    /// The job has been asked to end.
    Interrupted {
        /// The number of the signal, as [`Stop::signal`](crate::stop::Stop::signal) has it.
        signal: u8,
        /// The message with what the user has to know about it; empty if nothing is left half done.
        message: String,
    },
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Failure::Failed(message) | Failure::Arguments(message) | Failure::Interrupted { message, .. }) = self;
        f.write_str(message)
    }
}

impl std::error::Error for Failure {}
