//! The end of the simulator: by a signal, or by the end of standard input.

use std::io::{ErrorKind, Read};
use std::time::Instant;

use rustix::fd::{AsFd, BorrowedFd};
use tmcl_link::EndSignal;
use tmcl_link::poll::readable;
use tmcl_link::system::{Input, standard_input};
use tmcl_link::wording::words;
use tmcl_tools::stop::Stop;

use crate::failure::Failure;

/// Watches for signals and for the end of standard input.
#[derive(Debug)]
pub(crate) struct Ending {
    signal: EndSignal,
    stdin: Option<Input>,
}

impl Ending {
    /// Watches for signals, and with `stdin` also for the end of standard input.
    pub(crate) fn watch(stdin: bool) -> Result<Self, Failure> {
        let failed = |error| Failure::Failed(format!("cannot read standard input: {}", words(error)));
        let stdin = stdin.then(standard_input).transpose().map_err(failed)?;
        Ok(Ending { signal: EndSignal::watch()?, stdin })
    }

    /// The sources to wait for: one of these can be read when the end may have come.
    pub(crate) fn signs(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        std::iter::once(self.signal.as_fd()).chain(self.stdin.as_ref().map(AsFd::as_fd))
    }

    /// True if a signal has come or standard input has ended.
    pub(crate) fn has_come(&mut self) -> bool {
        self.signal.happened() || self.stdin.as_mut().is_some_and(is_at_end)
    }
}

fn is_at_end(stdin: &mut Input) -> bool {
    if !readable(stdin, Instant::now()).unwrap_or(true) {
        return false;
    }
    // Bytes on standard input are read and ignored.
    match stdin.read(&mut [0; 4096]) {
        Ok(count) => count == 0,
        Err(error) => !matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock),
    }
}
