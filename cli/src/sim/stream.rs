//! A byte stream that never makes anybody wait.

use std::io::{ErrorKind, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};

use rustix::event::PollFlags;

/// What reading gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// So many bytes.
    Bytes(usize),
    /// Nothing has arrived.
    Nothing,
    /// Nothing will arrive any more.
    Ended,
}

/// A pseudo terminal or socket in non-blocking mode, and what still has to be written to it.
#[derive(Debug)]
pub struct Stream<T> {
    io: T,
    waiting: Vec<u8>,
    limit: usize,
    ended: bool,
    broken: bool,
}

impl<T: Read + Write + AsFd> Stream<T> {
    /// The stream over `io`, which is in non-blocking mode. While `limit` bytes wait because the other side
    /// does not read, no more are taken.
    pub fn new(io: T, limit: usize) -> Self {
        Stream { io, waiting: Vec::new(), limit, ended: false, broken: false }
    }

    /// Reads what has arrived, as much as there is room for.
    pub fn read(&mut self, buffer: &mut [u8]) -> Input {
        if self.ended {
            return Input::Ended;
        }
        match self.io.read(buffer) {
            Ok(count) if count > 0 => Input::Bytes(count),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Input::Nothing,
            Ok(_) => {
                self.ended = true;
                Input::Ended
            }
            Err(_) => {
                self.give_up();
                Input::Ended
            }
        }
    }

    /// So much waits for the other side to read it that no more is taken.
    pub fn is_full(&self) -> bool {
        !self.broken && self.waiting.len() >= self.limit
    }

    /// Writes, at once or as soon as the other side makes room. False if too much waits already: then
    /// nothing of `bytes` is written.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        if self.waiting.len() >= self.limit {
            return false;
        }
        self.waiting.extend_from_slice(bytes);
        self.flush();
        true
    }

    /// Writes what waits, as far as there is room.
    pub fn flush(&mut self) {
        while !self.waiting.is_empty() && !self.broken {
            match self.io.write(&self.waiting) {
                Ok(count) if count > 0 => drop(self.waiting.drain(..count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                Ok(_) | Err(_) => self.broken = true,
            }
        }
    }

    /// Gives the other side up: what waits is not written.
    pub fn give_up(&mut self) {
        self.ended = true;
        self.broken = true;
    }

    /// The other side sends nothing more.
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// Nothing can be written any more, or all that was to be written is.
    pub fn drained(&self) -> bool {
        self.broken || self.waiting.is_empty()
    }

    /// Nothing can be read or written any more.
    pub fn broken(&self) -> bool {
        self.broken
    }

    /// What to wait for: bytes to read unless `full`, room to write if there is something to be written.
    /// None if there is nothing to wait for.
    pub fn interest(&self, full: bool) -> Option<(BorrowedFd<'_>, PollFlags)> {
        let mut flags = PollFlags::empty();
        flags.set(PollFlags::IN, !self.ended && !full);
        flags.set(PollFlags::OUT, !self.drained());
        (!flags.is_empty()).then(|| (self.io.as_fd(), flags))
    }
}
