//! Waiting for what can be read: file descriptors on Unix, sockets on Windows.

use std::time::Instant;

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::fd::AsFd;
use rustix::io::Errno;

/// The outcome of a wait for two descriptors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ready {
    /// The first can be read; the second may be, too.
    First,
    /// The second alone can be read, or its other end has been closed.
    Second,
    /// Neither, and the time is over.
    Nothing,
}

/// Waits until one of two descriptors can be read, at most until the instant `until`, or without end.
pub fn either(first: &impl AsFd, second: &impl AsFd, until: Option<Instant>) -> std::io::Result<Ready> {
    let mut polled = [PollFd::new(first, PollFlags::IN), PollFd::new(second, PollFlags::IN)];
    Ok(match wait(&mut polled, until)? {
        false => Ready::Nothing,
        true if polled[0].revents().is_empty() => Ready::Second,
        true => Ready::First,
    })
}

/// Waits until a descriptor can be read, at most until the instant `until`. False if it cannot be read by then.
pub fn readable(fd: &impl AsFd, until: Instant) -> std::io::Result<bool> {
    wait(&mut [PollFd::new(fd, PollFlags::IN)], Some(until))
}

fn wait(polled: &mut [PollFd<'_>], until: Option<Instant>) -> std::io::Result<bool> {
    loop {
        // A time that the system cannot count has no end.
        let timeout = until.and_then(|until| Timespec::try_from(until.saturating_duration_since(Instant::now())).ok());
        match rustix::event::poll(polled, timeout.as_ref()) {
            Ok(count) => return Ok(count > 0),
            Err(Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
    }
}
