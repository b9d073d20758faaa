//! The failure of a subcommand of `tmcl`, with its exit code.

use std::fmt;
use std::process::ExitCode;

use tmcl_link::system::has_no_reader;
use tmcl_link::wording::words;
use tmcl_tools::conversation::Error;
use tmcl_tools::debug::Trouble;
use tmcl_tools::stop::Stop;

/// Exit code of a program that is ended by the signal of this number, as shells show it: 130 after Ctrl-C (SIGINT), 143
/// after SIGTERM.
const SIGNALLED: u8 = 128;
/// Exit code of a program whose standard output has been closed: that of SIGPIPE, which has the number 13.
const CLOSED: u8 = SIGNALLED + 13;

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
    /// A signal has ended the subcommand; exit code 128 and the number of the signal.
    Interrupted {
        /// The number of the signal.
        signal: u8,
        /// The facts that the user has to know about it; empty if nothing is left half done.
        message: String,
    },
    /// Nobody reads standard output any more, as behind `| head`; nothing is said about it, and the exit code is 141.
    Closed,
}

impl Failure {
    /// The exit code of the program.
    pub fn exit_code(&self) -> ExitCode {
        self.code().into()
    }

    /// The exit code of the program as a number.
    pub fn code(&self) -> u8 {
        match self {
            Failure::Failed(_) | Failure::Reported => 1,
            Failure::Arguments(_) => 2,
            Failure::Interrupted { signal, .. } => SIGNALLED.saturating_add(*signal),
            Failure::Closed => CLOSED,
        }
    }

    /// The message for the user; `None` if there is nothing to say.
    pub fn message(&self) -> Option<&str> {
        match self {
            Failure::Failed(message) | Failure::Arguments(message) | Failure::Interrupted { message, .. } => {
                Some(message.as_str()).filter(|message| !message.is_empty())
            }
            Failure::Reported | Failure::Closed => None,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message().unwrap_or_default())
    }
}

impl std::error::Error for Failure {}

impl From<tmcl_tools::failure::Failure> for Failure {
    fn from(failure: tmcl_tools::failure::Failure) -> Self {
        match failure {
            tmcl_tools::failure::Failure::Failed(message) => Failure::Failed(message),
            tmcl_tools::failure::Failure::Arguments(message) => Failure::Arguments(message),
            tmcl_tools::failure::Failure::Interrupted { signal, message } => Failure::Interrupted { signal, message },
        }
    }
}

/// Failures of work that a signal has ended.
pub(crate) trait Ended: Stop {
    /// The failure of a subcommand that has been asked to end, with what the user has to know about it; nothing is said
    /// if that is empty.
    fn failure(&self, message: impl Into<String>) -> Failure {
        self.interrupted(&message.into()).into()
    }
}

impl<T: Stop> Ended for T {}

impl From<tmcl_link::Error> for Failure {
    fn from(tmcl_link::Error(message): tmcl_link::Error) -> Self {
        Failure::Failed(message)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        tmcl_tools::failure::Failure::from(error).into()
    }
}

impl From<Trouble> for Failure {
    fn from(trouble: Trouble) -> Self {
        tmcl_tools::failure::Failure::from(trouble).into()
    }
}

impl From<tmcl_server::failure::Failure> for Failure {
    fn from(failure: tmcl_server::failure::Failure) -> Self {
        match failure {
            tmcl_server::failure::Failure::Failed(message) => Failure::Failed(message),
            tmcl_server::failure::Failure::Arguments(message) => Failure::Arguments(message),
            tmcl_server::failure::Failure::Output(error) => error.into(),
        }
    }
}

/// Where an output is written to as anything else is, a failure is what the error has inside.
impl From<Failure> for std::io::Error {
    fn from(failure: Failure) -> Self {
        std::io::Error::other(failure)
    }
}

/// An error of standard output ends the subcommand, because nobody reads the output any more.
impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        error.downcast().unwrap_or_else(|error| match has_no_reader(&error) {
            true => Failure::Closed,
            false => Failure::Failed(format!("cannot write the output: {}", words(error))),
        })
    }
}
