//! One end of a byte link: the bytes of one client, and the silences between them.

use std::io::{Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

use rustix::event::PollFlags;
use tmcm::tmcl::binary::{Framer, TELEGRAM};

use super::stream::{Input, Stream};
use crate::client::Client;

/// Silence after which an unfinished telegram is given up. It counts from when bytes were read, and only if
/// another look found none: a host or a simulator that was held up for a moment does not tear a telegram.
const GAP: Duration = Duration::from_micros(Framer::GAP.0);
/// The same on TCP, where a host's bytes may be held back: Nagle's algorithm waits for an acknowledgement, and
/// the peer's delays that for up to 200 ms.
const TCP_GAP: Duration = Duration::from_millis(250);
/// Bytes of a client that may wait for the module: more are not read. So none can keep the others waiting, and what is
/// sent too fast waits where it comes from.
const ROOM: usize = 16 * TELEGRAM;
/// Most that is thrown away at once: more than waits in a socket.
const MOST_THROWN_AWAY: usize = 16 << 20;

/// What comes from a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival<'a> {
    /// Bytes, at least one.
    Bytes(&'a [u8]),
    /// The end of a telegram, finished or not: nothing has come for a while. Told once.
    Silence,
}

/// A stream of bytes from one client.
#[derive(Debug)]
pub struct Endpoint<T> {
    /// The bytes.
    pub stream: Stream<T>,
    /// Who sends them.
    pub client: Client,
    gap: Duration,
    /// So much waits that nothing is read.
    full: bool,
    /// When bytes were last read, until the silence after them has been told.
    heard: Option<Instant>,
}

impl<T: Read + Write + AsFd> Endpoint<T> {
    /// An endpoint at which nothing has arrived yet.
    pub fn new(stream: Stream<T>, client: Client) -> Self {
        Endpoint { stream, client, gap: GAP, full: false, heard: None }
    }

    /// The same for a TCP connection.
    pub fn over_tcp(stream: Stream<T>, client: Client) -> Self {
        Endpoint { gap: TCP_GAP, ..Self::new(stream, client) }
    }

    /// Takes what has arrived, while `unread` bytes of what has been taken before wait for the module.
    pub fn receive(&mut self, unread: usize, take: impl FnOnce(Arrival<'_>)) {
        self.full = unread >= ROOM;
        if self.full {
            return;
        }
        let mut buffer = [0; ROOM];
        let room = buffer.get_mut(unread..).unwrap_or_default();
        if let Input::Bytes(count) = self.stream.read(room) {
            self.heard = Some(Instant::now());
            take(Arrival::Bytes(room.get(..count).unwrap_or_default()));
        } else if self.silence_ends().is_some_and(|end| end <= Instant::now()) {
            self.heard = None;
            take(Arrival::Silence);
        }
    }

    /// What has arrived is lost; `take` may look at it.
    pub fn throw_away(&mut self, mut take: impl FnMut(&[u8])) {
        self.heard = None;
        let (mut buffer, mut thrown) = ([0; ROOM], 0);
        while thrown < MOST_THROWN_AWAY
            && let Input::Bytes(count) = self.stream.read(&mut buffer)
        {
            thrown += count;
            take(buffer.get(..count).unwrap_or_default());
        }
    }

    /// What there is to wait for: bytes, if they would be taken, or room for replies.
    pub fn interest(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        self.stream.interest(self.full)
    }

    /// When the silence has lasted long enough to be told, if it has not been.
    pub fn silence_ends(&self) -> Option<Instant> {
        self.heard.filter(|_| !self.full).map(|heard| heard + self.gap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixStream;

    /// The host's end of a link, and the module's.
    fn link() -> (UnixStream, Endpoint<UnixStream>) {
        let (host, module) = UnixStream::pair().unwrap();
        module.set_nonblocking(true).unwrap();
        (host, Endpoint::new(Stream::new(module, 1), Client(1)))
    }

    /// Bytes, or `None` for a silence.
    fn received(endpoint: &mut Endpoint<UnixStream>) -> Vec<Option<Vec<u8>>> {
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
    fn a_silence_is_told_once() {
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
