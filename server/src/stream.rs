//! A byte stream to a client: reading and writing never block.

use std::io::{ErrorKind, Read, Write};

use rustix::event::PollFlags;
use rustix::fd::{AsFd, BorrowedFd};

use crate::greeting::{Caller, Greeting};

/// The outcome of a read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The number of bytes that were read.
    Bytes(usize),
    /// Bytes have arrived, and are held back until it is known who sends them.
    Held,
    /// No byte has arrived.
    Nothing,
    /// No byte will arrive any more.
    Ended,
}

/// A pseudo terminal or socket in non-blocking mode, and the bytes still to be written to it.
#[derive(Debug)]
pub struct Stream<T> {
    io: T,
    /// The beginning of the stream, until it is known who is at the other end.
    greeting: Option<Greeting>,
    waiting: Vec<u8>,
    limit: usize,
    /// Number of bytes that have been written so far.
    written: u64,
    ended: bool,
    broken: bool,
}

impl<T: Read + Write + AsFd> Stream<T> {
    /// A stream over `io`, which must be in non-blocking mode. While `limit` bytes wait because the other side does not
    /// read, [`write`](Self::write) takes no more.
    pub fn new(io: T, limit: usize) -> Self {
        Stream { io, greeting: None, waiting: Vec::new(), limit, written: 0, ended: false, broken: false }
    }

    /// A stream whose other end may be a web browser. If it is one, the stream ends, and nothing that it has sent is
    /// read.
    pub fn guarded(io: T, limit: usize) -> Self {
        Stream { greeting: Some(Greeting::default()), ..Self::new(io, limit) }
    }

    /// Reads bytes that have arrived, as many as fit `buffer`.
    pub fn read(&mut self, buffer: &mut [u8]) -> Input {
        let Some(mut greeting) = self.greeting.take() else { return self.read_on(buffer) };
        let Some((front, rest)) = buffer.split_at_mut_checked(greeting.held().len()) else { return Input::Nothing };
        front.copy_from_slice(greeting.held());
        let (input, before) = (self.read_on(rest), front.len());
        match input {
            Input::Bytes(count) => match greeting.hear(rest.get(..count).unwrap_or_default()) {
                Caller::Host => return Input::Bytes(before + count),
                Caller::Browser => {
                    self.give_up();
                    return Input::Ended;
                }
                Caller::Unknown => {
                    self.greeting = Some(greeting);
                    return Input::Held;
                }
            },
            // Who has said all has not sent a request of HTTP. The next read finds the end again.
            Input::Ended if before > 0 && !self.broken => {
                self.ended = false;
                return Input::Bytes(before);
            }
            Input::Ended | Input::Held | Input::Nothing => self.greeting = Some(greeting),
        }
        input
    }

    /// Gives bytes that are held back, because they are not to wait any longer.
    pub fn release(&mut self) -> Vec<u8> {
        self.greeting.as_mut().map(Greeting::release).unwrap_or_default()
    }

    /// Reads bytes from whoever is at the other end.
    fn read_on(&mut self, buffer: &mut [u8]) -> Input {
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

    /// True while [`write`](Self::write) takes no bytes, because too many wait for the other side to read them.
    pub fn is_full(&self) -> bool {
        !self.broken && self.waiting.len() >= self.limit
    }

    /// Writes `bytes`, at once or as soon as the other side makes room. False, and nothing is written, if too many
    /// bytes wait already.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        if self.waiting.len() >= self.limit {
            return false;
        }
        self.waiting.extend_from_slice(bytes);
        self.flush();
        true
    }

    /// Writes waiting bytes, as many as the other side has room for.
    pub fn flush(&mut self) {
        while !self.waiting.is_empty() && !self.broken {
            match self.io.write(&self.waiting) {
                Ok(count) if count > 0 => {
                    self.waiting.drain(..count);
                    self.written += count as u64;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                Ok(_) | Err(_) => self.broken = true,
            }
        }
    }

    /// Number of bytes that wait for the other side to read them.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }

    /// Number of bytes for which the other side has had room so far.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Ends the stream; waiting bytes are dropped.
    pub fn give_up(&mut self) {
        self.ended = true;
        self.broken = true;
    }

    /// True once the other side sends nothing more.
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// True while no byte waits to be written, or none can be written any more.
    pub fn drained(&self) -> bool {
        self.broken || self.waiting.is_empty()
    }

    /// True once nothing can be read or written any more.
    pub fn broken(&self) -> bool {
        self.broken
    }

    /// The descriptor and events to poll for: bytes to read unless `full`, and room if bytes wait to be written.
    /// `None` if there is nothing to poll for.
    pub fn interest(&self, full: bool) -> Option<(BorrowedFd<'_>, PollFlags)> {
        let mut flags = PollFlags::empty();
        flags.set(PollFlags::IN, !self.ended && !full);
        flags.set(PollFlags::OUT, !self.drained());
        (!flags.is_empty()).then(|| (self.io.as_fd(), flags))
    }
}
