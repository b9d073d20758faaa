//! Signals that ask for the end, as something one can wait for.

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
    /// From now on these signals no longer end the program by themselves.
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

    /// A signal has come.
    pub fn happened(&self) -> bool {
        self.within(Duration::ZERO)
    }

    /// Sleeps for that long, or until a signal comes: then it is true.
    pub fn within(&self, time: Duration) -> bool {
        // Where the descriptor cannot be waited for, the sleep would have no end.
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
