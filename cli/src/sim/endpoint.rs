//! One end of a byte link: the bytes of one client, and the silences between them.

use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use tmcm::tmcl::binary::Framer;

use super::stream::{Input, Stream};
use crate::virtual_module::Client;

/// Silence after which an unfinished telegram is given up. It counts from when bytes were read, and only if
/// another look found none: a host or a simulator that was held up for a moment does not tear a telegram.
const GAP: Duration = Duration::from_micros(Framer::GAP.0);
/// The same on TCP, where a host's bytes may be held back: Nagle's algorithm waits for an acknowledgement, and
/// the peer's delays that for up to 200 ms.
const TCP_GAP: Duration = Duration::from_millis(250);
/// Bytes read in one turn, so that one link cannot keep all others waiting.
const PORTION: usize = 4096;

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
    /// When bytes were last read, until the silence after them has been told.
    heard: Option<Instant>,
}

impl<T: Read + Write + AsFd> Endpoint<T> {
    /// An endpoint at which nothing has arrived yet.
    pub fn new(stream: Stream<T>, client: Client) -> Self {
        Endpoint { stream, client, gap: GAP, heard: None }
    }

    /// The same for a TCP connection.
    pub fn over_tcp(stream: Stream<T>, client: Client) -> Self {
        Endpoint { gap: TCP_GAP, ..Self::new(stream, client) }
    }

    /// Takes what has arrived.
    pub fn receive(&mut self, take: impl FnOnce(Arrival<'_>)) {
        let mut buffer = [0; PORTION];
        if let Input::Bytes(count) = self.stream.read(&mut buffer) {
            self.heard = Some(Instant::now());
            take(Arrival::Bytes(buffer.get(..count).unwrap_or_default()));
        } else if self.silence_ends().is_some_and(|end| end <= Instant::now()) {
            self.heard = None;
            take(Arrival::Silence);
        }
    }

    /// When the silence has lasted long enough to be told, if it has not been.
    pub fn silence_ends(&self) -> Option<Instant> {
        self.heard.map(|heard| heard + self.gap)
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
        endpoint.receive(|arrival| {
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
