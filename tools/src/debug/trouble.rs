//! The reasons why an action of the user has not been carried out.

use crate::conversation::Error;
use crate::failure::Failure;

/// The reason why an action has not been carried out.
#[derive(Debug)]
pub enum Trouble {
    /// The user has asked for what cannot be, or the module has refused it; the message. The debugger goes on.
    Mistake(String),
    /// The debugger cannot go on.
    Failure(Failure),
}

impl From<Error> for Trouble {
    fn from(error: Error) -> Self {
        match error.is_refusal() {
            true => Trouble::Mistake(error.to_string()),
            false => Trouble::Failure(error.into()),
        }
    }
}

impl From<String> for Trouble {
    fn from(message: String) -> Self {
        Trouble::Mistake(message)
    }
}

impl From<Failure> for Trouble {
    fn from(failure: Failure) -> Self {
        Trouble::Failure(failure)
    }
}

impl From<Trouble> for Failure {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Mistake(message) => Failure::Failed(message),
            Trouble::Failure(failure) => failure,
        }
    }
}
