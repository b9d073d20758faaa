//! The USB cable of a module that runs its image: several hosts share what is one serial port to the module.
//!
//! The module does not know who speaks. A host has the cable until as much has come back as it has said, as it is with
//! telegrams, or nothing has moved for a while; what comes back meanwhile is for it.

use std::collections::VecDeque;

use hal_sim::clock::{MILLISECOND, Nanos};

use super::pieces::Pieces;
use crate::virtual_module::Client;

/// A host whose request is not answered has the cable for so long. Storing takes some 20 ms.
const PATIENCE: Nanos = 250 * MILLISECOND;
/// A silence that the firmware takes for the end of a telegram: it waits for 5 ms.
pub(super) const GAP: Nanos = 6 * MILLISECOND;

/// Bytes that wait for the cable.
#[derive(Debug)]
struct Waiting {
    client: Client,
    bytes: Vec<u8>,
    /// A silence follows.
    gap: bool,
}

/// The cable.
#[derive(Debug, Default)]
pub(super) struct Cable {
    hosts: Vec<(Client, Pieces)>,
    waiting: VecDeque<Waiting>,
    /// Who has the cable, or had it last.
    speaker: Client,
    /// How many bytes have not come back.
    missing: usize,
    /// When something last moved.
    moved: Nanos,
    /// Until when nothing is sent.
    quiet: Nanos,
}

impl Cable {
    /// Bytes from a host.
    pub(super) fn push(&mut self, client: Client, bytes: &[u8]) {
        let whole = self.pieces(client).push(bytes);
        if !whole.is_empty() {
            self.waiting.push_back(Waiting { client, bytes: whole, gap: false });
        }
    }

    /// A host is silent.
    pub(super) fn silence(&mut self, client: Client) {
        if let Some(bytes) = self.pieces(client).silence() {
            self.waiting.push_back(Waiting { client, bytes, gap: true });
        }
    }

    /// A host has gone.
    pub(super) fn forget(&mut self, client: Client) {
        self.silence(client);
        self.hosts.retain(|(host, _)| *host != client);
    }

    /// What goes to the module now.
    pub(super) fn next(&mut self, now: Nanos) -> Option<Vec<u8>> {
        let speaker = self.speaker;
        let taken = self.is_taken(now);
        let ready = |waiting: &mut Waiting| !taken || waiting.client == speaker;
        if now < self.quiet {
            return None;
        }
        let Waiting { client, bytes, gap } = self.waiting.pop_front_if(ready)?;
        self.missing = if client == self.speaker { self.missing + bytes.len() } else { bytes.len() };
        (self.speaker, self.moved) = (client, now);
        self.quiet = if gap { now + GAP } else { 0 };
        Some(bytes)
    }

    /// So many bytes have come from the module; gives whom they are for.
    pub(super) fn hear(&mut self, now: Nanos, count: usize) -> Client {
        self.missing = self.missing.saturating_sub(count);
        self.moved = now;
        self.speaker
    }

    /// How many portions wait.
    pub(super) fn backlog(&self) -> usize {
        self.waiting.len()
    }

    /// True while something of this client's waits or may come back to it.
    pub(super) fn owes(&self, now: Nanos, client: Client) -> bool {
        self.waiting.iter().any(|waiting| waiting.client == client) || self.speaker == client && self.is_taken(now)
    }

    /// The module has lost its power, or the cable has been pulled out: nothing comes back any more, and what was half
    /// said is forgotten.
    pub(super) fn cut(&mut self) {
        *self = Cable { speaker: self.speaker, ..Cable::default() };
    }

    fn is_taken(&self, now: Nanos) -> bool {
        self.missing > 0 && now < self.moved + PATIENCE
    }

    fn pieces(&mut self, client: Client) -> &mut Pieces {
        let index = self.hosts.iter().position(|(host, _)| *host == client).unwrap_or_else(|| {
            self.hosts.push((client, Pieces::default()));
            self.hosts.len() - 1
        });
        &mut self.hosts[index].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Client = Client(1);
    const OTHER: Client = Client(2);

    #[test]
    fn hosts_take_turns() {
        let mut cable = Cable::default();
        cable.push(ONE, b"111111111");
        cable.push(OTHER, b"222222222");
        assert_eq!(cable.next(0).as_deref(), Some(&b"111111111"[..]));
        assert_eq!(cable.next(PATIENCE - 1), None);
        assert!(cable.owes(1, ONE) && cable.owes(1, OTHER));
        assert_eq!(cable.hear(1, 9), ONE);
        assert!(!cable.owes(1, ONE));
        assert_eq!(cable.next(1).as_deref(), Some(&b"222222222"[..]));
        // Something unasked for goes to who spoke last.
        assert_eq!((cable.hear(2, 9), cable.hear(3, 9)), (OTHER, OTHER));
    }

    #[test]
    fn who_gets_no_answer_has_the_cable_for_a_while() {
        let mut cable = Cable::default();
        cable.push(ONE, b"111111111");
        cable.push(OTHER, b"222222222");
        cable.push(ONE, b"333333333");
        assert!(cable.next(5).is_some() && cable.next(5).is_none());
        assert_eq!(cable.next(5 + PATIENCE).as_deref(), Some(&b"222222222"[..]));
        assert!(cable.owes(5 + PATIENCE, ONE));
    }

    #[test]
    fn nothing_is_left_of_what_was_cut() {
        let mut cable = Cable::default();
        cable.push(ONE, b"111111111");
        cable.push(OTHER, b"2222");
        assert!(cable.next(0).is_some());
        cable.cut();
        assert!(!cable.owes(0, ONE));
        cable.push(OTHER, b"333333333");
        assert_eq!(cable.next(0).as_deref(), Some(&b"333333333"[..]));
    }

    #[test]
    fn a_silence_is_one_for_the_module() {
        let mut cable = Cable::default();
        cable.push(ONE, b"1234");
        cable.silence(ONE);
        cable.push(ONE, b"123456789");
        assert_eq!(cable.next(0).as_deref(), Some(&b"1234"[..]));
        assert_eq!(cable.next(GAP - 1), None);
        assert_eq!(cable.next(GAP).as_deref(), Some(&b"123456789"[..]));
    }
}
