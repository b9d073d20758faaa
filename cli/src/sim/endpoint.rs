//! One end of a byte link: bytes become telegrams, replies become bytes.

use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use tmcm::tmcl::binary::{Framer, Telegram};
use tmcm::units::Micros;

use super::stream::{Input, Stream};
use crate::virtual_module::Client;

/// Silence after which an unfinished telegram is given up. It counts from when bytes were read, and only if
/// another look found none: a host or a simulator that was held up for a moment does not tear a telegram.
const GAP: Duration = Duration::from_micros(Framer::GAP.0);
/// The framer is told of silences by [`Framer::reset`] alone; for it all bytes arrive at one time.
const NOW: Micros = Micros(0);
/// Bytes read in one turn, so that one link cannot keep all others waiting.
const PORTION: usize = 4096;

/// A stream of telegrams from one client.
#[derive(Debug)]
pub struct Endpoint<T> {
    /// The bytes.
    pub stream: Stream<T>,
    /// Who sends them.
    pub client: Client,
    framer: Framer,
    unfinished: bool,
    heard: Instant,
}

impl<T: Read + Write + AsFd> Endpoint<T> {
    /// An endpoint at which nothing has arrived yet.
    pub fn new(stream: Stream<T>, client: Client) -> Self {
        Endpoint { stream, client, framer: Framer::new(), unfinished: false, heard: Instant::now() }
    }

    /// Takes what has arrived and hands out the telegrams that are complete.
    pub fn receive(&mut self, mut take: impl FnMut(Telegram)) {
        let mut buffer = [0; PORTION];
        let Input::Bytes(count) = self.stream.read(&mut buffer) else {
            if self.silence_ends().is_some_and(|end| end <= Instant::now()) {
                self.framer.reset();
                self.unfinished = false;
            }
            return;
        };
        for byte in buffer.iter().take(count) {
            let telegram = self.framer.push(*byte, NOW);
            self.unfinished = telegram.is_none();
            telegram.into_iter().for_each(&mut take);
        }
        self.heard = Instant::now();
    }

    /// When the unfinished telegram is given up, if there is one.
    pub fn silence_ends(&self) -> Option<Instant> {
        self.unfinished.then(|| self.heard + GAP)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixStream;
    use tmcm::tmcl::{Command, binary};

    /// The host's end of a link, and the module's.
    fn link() -> (UnixStream, Endpoint<UnixStream>) {
        let (host, module) = UnixStream::pair().unwrap();
        module.set_nonblocking(true).unwrap();
        (host, Endpoint::new(Stream::new(module, TELEGRAM), Client(1)))
    }

    const TELEGRAM: usize = binary::TELEGRAM;

    fn telegram() -> Telegram {
        binary::encode_command(1, Command::new(6, 4, 0, 0))
    }

    fn received(endpoint: &mut Endpoint<UnixStream>) -> Vec<Telegram> {
        let mut all = Vec::new();
        endpoint.receive(|telegram| all.push(telegram));
        all
    }

    #[test]
    fn a_simulator_that_was_held_up_does_not_tear_a_telegram() {
        let (mut host, mut endpoint) = link();
        host.write_all(&telegram()[..4]).unwrap();
        assert!(received(&mut endpoint).is_empty());
        host.write_all(&telegram()[4..]).unwrap();
        std::thread::sleep(3 * GAP);
        assert_eq!(received(&mut endpoint), [telegram()]);
        assert_eq!(endpoint.silence_ends(), None);
    }

    #[test]
    fn a_silence_that_was_seen_ends_an_unfinished_telegram() {
        let (mut host, mut endpoint) = link();
        host.write_all(&telegram()[..4]).unwrap();
        assert!(received(&mut endpoint).is_empty());
        assert!(endpoint.silence_ends().is_some());
        std::thread::sleep(3 * GAP);
        assert!(received(&mut endpoint).is_empty());
        assert_eq!(endpoint.silence_ends(), None);
        host.write_all(&[telegram(), telegram()].concat()).unwrap();
        assert_eq!(received(&mut endpoint), [telegram(), telegram()]);
    }
}
