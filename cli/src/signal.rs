//! Signals that ask the program to end, as a descriptor that can be polled.

use std::io::Read;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use crate::failure::Failure;
use crate::link::readable;

/// A file descriptor that can be read once one of the signals has come: Ctrl-C (SIGINT), SIGTERM or SIGHUP.
#[derive(Debug)]
pub struct EndSignal(UnixStream);

impl EndSignal {
    /// Watches for these signals, which from now on no longer end the program by themselves.
    ///
    /// # Errors
    /// The system refuses to watch for a signal.
    pub fn watch(signals: &[i32]) -> Result<Self, Failure> {
        Self::register(signals).map_err(|error| Failure::Failed(format!("cannot watch for signals: {error}")))
    }

    fn register(signals: &[i32]) -> std::io::Result<Self> {
        let (stop, bell) = UnixStream::pair()?;
        stop.set_nonblocking(true)?;
        for signal in signals {
            signal_hook::low_level::pipe::register(*signal, bell.try_clone()?)?;
        }
        Ok(EndSignal(stop))
    }

    /// True if a signal has come.
    pub fn happened(&self) -> bool {
        self.within(Duration::ZERO)
    }

    /// Sleeps for `time`, or until a signal comes. True if a signal has come.
    pub fn within(&self, time: Duration) -> bool {
        // If the descriptor cannot be polled, the loops that call this would never end; so an error counts as a signal.
        readable(&self.0, Instant::now() + time).unwrap_or(true)
    }

    /// Forgets the signals that have come so far.
    pub fn forget(&mut self) {
        let mut bells = [0; 64];
        while self.0.read(&mut bells).is_ok_and(|count| count > 0) {}
    }
}

impl AsFd for EndSignal {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}
