//! The simulator's end of a byte link: the bytes of one client, and the silences between telegrams.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use rustix::event::PollFlags;
use rustix::fd::{AsFd, BorrowedFd};
use tmcm::tmcl::binary::{Framer, TELEGRAM};
use tmcm_sim::client::Client;

use crate::stream::{Input, Stream};

/// Silence after which an unfinished telegram is given up. The silence begins when bytes were read. It ends a telegram
/// only if a later read found no bytes, so that a simulator that was held up for a moment does not tear a telegram.
const GAP: Duration = Duration::from_micros(Framer::GAP.0);
/// Silence after which an unfinished telegram on TCP is given up. It is longer, because Nagle's algorithm holds bytes
/// back until an acknowledgement, which the peer may delay by 200 ms.
const TCP_GAP: Duration = Duration::from_millis(250);
/// Most bytes of a client that may wait for the module. Further bytes are not read but wait in the client's own
/// buffers, so that no client can delay the others.
const ROOM: usize = 16 * TELEGRAM;
/// Most bytes thrown away at once: more than a socket's buffer holds, but not without end.
const MOST_THROWN_AWAY: usize = 16 << 20;

/// An arrival from a client: bytes, or a silence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival<'a> {
    /// Bytes, at least one.
    Bytes(&'a [u8]),
    /// No byte has come for so long that a telegram ends, finished or not. Reported once per silence.
    Silence,
}

/// A stream of bytes from one client.
#[derive(Debug)]
pub struct Endpoint<T> {
    /// The stream of bytes.
    pub stream: Stream<T>,
    /// The client at the other end.
    pub client: Client,
    /// Silence that ends a telegram.
    gap: Duration,
    /// True while so many bytes wait for the module that none is read.
    full: bool,
    /// When bytes were last read; `None` once the silence after them has been reported.
    heard: Option<Instant>,
}

impl<T: Read + Write + AsFd> Endpoint<T> {
    /// The endpoint of a pseudo terminal or local socket.
    pub fn new(stream: Stream<T>, client: Client) -> Self {
        Endpoint { stream, client, gap: GAP, full: false, heard: None }
    }

    /// The endpoint of a TCP connection.
    pub fn over_tcp(stream: Stream<T>, client: Client) -> Self {
        Endpoint { gap: TCP_GAP, ..Self::new(stream, client) }
    }

    /// Reads what has arrived and passes it to `take`. `unread` is the number of bytes read before that still wait for
    /// the module.
    pub fn receive(&mut self, unread: usize, mut take: impl FnMut(Arrival<'_>)) {
        self.full = unread >= ROOM;
        if self.full {
            return;
        }
        let mut buffer = [0; ROOM];
        let room = buffer.get_mut(unread..).unwrap_or_default();
        match self.stream.read(room) {
            Input::Bytes(count) => {
                self.heard = Some(Instant::now());
                take(Arrival::Bytes(room.get(..count).unwrap_or_default()));
            }
            Input::Held => self.heard = Some(Instant::now()),
            Input::Nothing | Input::Ended => {
                if self.silence_ends().is_some_and(|end| end <= Instant::now()) {
                    self.heard = None;
                    // What is held back is no whole telegram. The silence ends one that a host has begun, and somebody
                    // who types in ASCII mode waits for the echo.
                    let held = self.stream.release();
                    if !held.is_empty() {
                        take(Arrival::Bytes(&held));
                    }
                    take(Arrival::Silence);
                }
            }
        }
    }

    /// Reads and drops what has arrived; `take` may look at the bytes.
    pub fn throw_away(&mut self, mut take: impl FnMut(&[u8])) {
        self.heard = None;
        let (mut buffer, mut thrown) = ([0; ROOM], 0);
        while thrown < MOST_THROWN_AWAY {
            match self.stream.read(&mut buffer) {
                Input::Bytes(count) => {
                    thrown += count;
                    take(buffer.get(..count).unwrap_or_default());
                }
                Input::Held => {}
                Input::Nothing | Input::Ended => break,
            }
        }
        take(&self.stream.release());
    }

    /// The descriptor and events to poll for: bytes, unless none would be read, and room for replies.
    pub fn interest(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        self.stream.interest(self.full)
    }

    /// When the present silence will have lasted long enough to be reported; `None` if it has been reported.
    pub fn silence_ends(&self) -> Option<Instant> {
        self.heard.filter(|_| !self.full).map(|heard| heard + self.gap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use tmcl_link::system::{self, Socket};

    /// Both ends of a link: the host's and the module's.
    fn link() -> (Socket, Endpoint<Socket>) {
        let (host, module) = system::pair().unwrap();
        module.set_nonblocking(true).unwrap();
        (host, Endpoint::new(Stream::new(module, 1), Client(1)))
    }

    /// The items that the endpoint passes on: bytes, or `None` for a silence.
    fn received(endpoint: &mut Endpoint<Socket>) -> Vec<Option<Vec<u8>>> {
        let mut all = Vec::new();
        endpoint.receive(0, |arrival| {
            all.push(if let Arrival::Bytes(bytes) = arrival { Some(bytes.to_vec()) } else { None });
        });
        all
    }

    #[test]
    fn a_simulator_that_was_held_up_sees_no_silence() {
        let (mut host, mut endpoint) = link();
        host.write_all(b"1234").unwrap();
        assert_eq!(received(&mut endpoint), [Some(b"1234".to_vec())]);
        host.write_all(b"56789").unwrap();
        std::thread::sleep(3 * GAP);
        assert_eq!(received(&mut endpoint), [Some(b"56789".to_vec())]);
    }

    #[test]
    fn a_silence_is_reported_once() {
        let (mut host, mut endpoint) = link();
        assert_eq!(endpoint.silence_ends(), None);
        assert!(received(&mut endpoint).is_empty());
        host.write_all(b"1234").unwrap();
        assert_eq!(received(&mut endpoint), [Some(b"1234".to_vec())]);
        assert!(received(&mut endpoint).is_empty() && endpoint.silence_ends().is_some());
        std::thread::sleep(3 * GAP);
        assert_eq!(received(&mut endpoint), [None]);
        assert!(received(&mut endpoint).is_empty());
        assert_eq!(endpoint.silence_ends(), None);
    }
}
