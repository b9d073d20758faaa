//! Whether what is under way is to end.

use std::time::Duration;

use crate::failure::Failure;

/// Tells whether the user, or a signal, has asked to end.
pub trait Stop {
    /// True if that has been asked.
    fn happened(&self) -> bool {
        self.within(Duration::ZERO)
    }

    /// Waits for so long, or until it is asked. True if it has been asked.
    fn within(&self, time: Duration) -> bool;

    /// The number of the signal that has asked: that of SIGINT for a user, and where there are no signals.
    fn signal(&self) -> u8;

    /// Forgets what has been asked so far: what has to be done before the end goes on until it is asked again.
    fn forget(&self);

    /// The failure of a job that has been asked to end, with what the user has to know about it; nothing is said if
    /// that is empty.
    fn interrupted(&self, message: &str) -> Failure {
        Failure::Interrupted { signal: self.signal(), message: message.into() }
    }
}

/// Nobody ever asks to end: for jobs that nobody watches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Never;

impl Stop for Never {
    fn within(&self, _: Duration) -> bool {
        false
    }

    fn signal(&self) -> u8 {
        0
    }

    fn forget(&self) {}
}
