//! The end of the simulator: by a signal, or by the end of standard input.

use std::io::Stdin;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Instant;

use rustix::io::Errno;
use tmcl_link::EndSignal;
use tmcl_link::poll::readable;
use tmcl_tools::stop::Stop;

use crate::failure::Failure;

/// Watches for signals and for the end of standard input.
#[derive(Debug)]
pub(crate) struct Ending {
    signal: EndSignal,
    stdin: Option<Stdin>,
}

impl Ending {
    /// Watches for signals, and with `stdin` also for the end of standard input.
    pub(crate) fn watch(stdin: bool) -> Result<Self, Failure> {
        Ok(Ending { signal: EndSignal::watch()?, stdin: stdin.then(std::io::stdin) })
    }

    /// The descriptors to poll: one of them can be read when the end may have come.
    pub(crate) fn signs(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        std::iter::once(self.signal.as_fd()).chain(self.stdin.as_ref().map(AsFd::as_fd))
    }

    /// True if a signal has come or standard input has ended.
    pub(crate) fn has_come(&self) -> bool {
        self.signal.happened() || self.stdin.as_ref().is_some_and(is_at_end)
    }
}

fn is_at_end(stdin: &Stdin) -> bool {
    // Bytes on standard input are read and ignored.
    readable(stdin, Instant::now()).unwrap_or(true)
        && !matches!(rustix::io::read(stdin, &mut [0; 4096]), Ok(1..) | Err(Errno::INTR | Errno::AGAIN))
}
