//! The USB cable of a module that runs its image: several hosts share one serial port of the module.
//!
//! The module cannot tell the hosts apart, so they take turns, one telegram or line each. A host has the cable until as
//! many bytes have come back as it has sent, or until no byte has moved for a while. A reply is as long as its
//! telegram. Bytes that come back meanwhile go to this host.
//!
//! To the module there is one connection while hosts come and go. A host may change its state: the mode (binary or
//! ASCII), and whether position-reached events are sent. So when a host that has changed the state leaves, the cable is
//! reset, and the remaining hosts find the link as after its start.
//!
//! While a host has changed the mode, other hosts cannot use the cable. As soon as another host sends bytes, the
//! session of the first is ended: it is treated as if it had left, and its connection is closed.

use std::collections::VecDeque;

use hal_sim::clock::{MILLISECOND, Nanos};
use tmcm::tmcl::Opcode;
use tmcm::tmcl::binary::{self, TELEGRAM, Telegram};

use crate::client::Client;
use crate::pieces::Pieces;

/// Longest wait for an answer to a host while other hosts want the cable. A storing command takes longer; the board
/// model shows when the module writes its EEPROM, and [`Cable::wait`] then prolongs the wait.
const PATIENCE: Nanos = 40 * MILLISECOND;
/// Longest wait for an answer to a host while no other host wants the cable.
const LONE_PATIENCE: Nanos = 5 * MILLISECOND;
/// Most bytes that a host alone may send ahead of the answers. The module would take more, but a second host's request
/// would have to wait for all of them.
const AHEAD: usize = 3 * TELEGRAM;
/// A silence long enough for the firmware, which ends a telegram after 5 ms.
pub(super) const GAP: Nanos = 6 * MILLISECOND;

/// A telegram or line of a host that waits for the cable.
#[derive(Debug)]
struct Portion {
    bytes: Vec<u8>,
    /// True if a silence must follow the bytes.
    gap: bool,
}

/// A host that shares the cable.
#[derive(Debug)]
struct Host {
    client: Client,
    pieces: Pieces,
    waiting: VecDeque<Portion>,
    /// True if the host has sent a command that changes the state of the connection.
    leaves_traces: bool,
    /// True if the host has left; it is removed when its waiting bytes have been sent.
    left: bool,
}

/// The shared cable.
#[derive(Debug, Default)]
pub(super) struct Cable {
    hosts: Vec<Host>,
    /// Index of the host whose turn is next.
    turn: usize,
    /// The host that has the cable, or had it last.
    speaker: Client,
    /// Number of bytes sent by the speaker for which no bytes have come back.
    unanswered: usize,
    /// When a byte last went to the module or came back.
    last_traffic: Nanos,
    /// End of the silence that must follow the last bytes.
    silent_until: Nanos,
    /// True while a command that changes the mode has no answer yet; with the answer the mode changes.
    mode_changing: bool,
    /// The host that has changed the mode; `None` while the mode is that of global parameter 67.
    mode_changed_by: Option<Client>,
    /// Hosts whose sessions have been ended since the last [`Cable::take_ended`].
    ended: Vec<Client>,
}

impl Cable {
    /// Takes bytes from a host.
    pub(super) fn push(&mut self, client: Client, bytes: &[u8]) {
        let host = self.host(client);
        for bytes in host.pieces.push(bytes) {
            host.leaves_traces |= leaves_traces(&bytes);
            host.waiting.push_back(Portion { bytes, gap: false });
        }
    }

    /// Takes a host's silence, which ends an unfinished telegram.
    pub(super) fn silence(&mut self, client: Client) {
        let host = self.host(client);
        host.waiting.extend(host.pieces.silence().map(|bytes| Portion { bytes, gap: true }));
    }

    /// Treats a host as having left.
    pub(super) fn forget(&mut self, client: Client) {
        let host = self.host(client);
        host.left = true;
        // An unfinished telegram of the host must be ended by a silence, unless the cable is reset anyway.
        if !host.leaves_traces {
            self.silence(client);
        }
    }

    /// True, once, if a host that has changed the state of the connection has left and no answer is awaited: the cable
    /// must be reset. Ends the session of a host that has changed the mode while others want the cable.
    pub(super) fn must_be_reset(&mut self, now: Nanos) -> bool {
        let stays = |client: &Client| self.hosts.iter().any(|host| host.client == *client && !host.left);
        let in_the_way = self.mode_changed_by.filter(|client| self.others_wait() && stays(client));
        // Answers to a host whose session is about to end are awaited for the shorter time only.
        if self.awaits_answer(now, if in_the_way.is_some() { LONE_PATIENCE } else { PATIENCE }) {
            return false;
        }
        if let Some(client) = in_the_way {
            let host = self.host(client);
            (host.left, host.leaves_traces) = (true, true);
            host.waiting.clear();
            self.ended.push(client);
        }
        let done = self.hosts.extract_if(.., |host| host.left && host.waiting.is_empty());
        let reset = done.fold(false, |reset, host| reset | host.leaves_traces);
        if reset {
            (self.unanswered, self.mode_changing, self.mode_changed_by) = (0, false, None);
            self.hosts.iter_mut().for_each(|host| host.leaves_traces = host.waiting.iter().any(Portion::leaves_traces));
        }
        reset
    }

    /// Prolongs the wait for an answer, because the module is writing its EEPROM.
    pub(super) fn wait(&mut self, now: Nanos) {
        self.last_traffic = now;
    }

    /// The bytes to send to the module now, if any.
    pub(super) fn next(&mut self, now: Nanos) -> Option<Vec<u8>> {
        if now < self.silent_until {
            return None;
        }
        let speaker = self.speaker;
        let busy = if self.others_wait() {
            self.awaits_answer(now, PATIENCE)
        } else {
            self.unanswered >= AHEAD && self.awaits_answer(now, LONE_PATIENCE)
        };
        if busy {
            return None;
        }
        // Before the reset that a departed host calls for, no other host may send.
        let leaving = self.hosts.iter().any(|host| host.left && host.leaves_traces);
        let count = self.hosts.len();
        let mut turns = (self.turn..count).chain(0..self.turn.min(count));
        let (index, client, Portion { bytes, gap }) = turns.find_map(|index| {
            let host = self.hosts.get_mut(index).filter(|host| host.left || !leaving)?;
            Some((index, host.client, host.waiting.pop_front()?))
        })?;
        self.turn = index + 1;
        // A change of the mode that has not been answered when another host sends has not taken place.
        self.mode_changing = changes_mode(&bytes) || self.mode_changing && client == speaker && self.unanswered > 0;
        self.unanswered = if client == speaker { self.unanswered + bytes.len() } else { bytes.len() };
        (self.speaker, self.last_traffic) = (client, now);
        self.silent_until = if gap { now + GAP } else { 0 };
        Some(bytes)
    }

    /// Records that `count` bytes have come from the module, and returns the host that they are for.
    pub(super) fn hear(&mut self, now: Nanos, count: usize) -> Client {
        self.unanswered = self.unanswered.saturating_sub(count);
        self.last_traffic = now;
        if std::mem::take(&mut self.mode_changing) {
            // There are two modes, so a second change restores the first mode.
            self.mode_changed_by = if self.mode_changed_by.is_some() { None } else { Some(self.speaker) };
        }
        self.speaker
    }

    /// The clients whose sessions have been ended in favour of others since the last call.
    pub(super) fn take_ended(&mut self) -> Vec<Client> {
        std::mem::take(&mut self.ended)
    }

    /// The telegrams and lines of a host that wait to be sent, and unfinished ones after which it was silent.
    pub(super) fn waiting(&self, client: Client) -> impl Iterator<Item = &[u8]> {
        let portions = self.hosts.iter().filter(move |host| host.client == client).flat_map(|host| &host.waiting);
        portions.map(|portion| portion.bytes.as_slice())
    }

    /// Number of bytes of a host that wait to be sent.
    pub(super) fn unread(&self, client: Client) -> usize {
        self.waiting(client).map(<[u8]>::len).sum()
    }

    /// The host that has the cable, or had it last.
    pub(super) fn speaker(&self) -> Client {
        self.speaker
    }

    /// True while bytes of any host wait, or a host that has left has not been removed.
    pub(super) fn has_unread(&self) -> bool {
        self.hosts.iter().any(|host| host.left || !host.waiting.is_empty())
    }

    /// True while bytes of this client wait, or an answer to the client is awaited.
    pub(super) fn owes(&self, now: Nanos, client: Client) -> bool {
        let waits = self.hosts.iter().any(|host| host.client == client && !host.waiting.is_empty());
        waits || self.speaker == client && self.awaits_answer(now, PATIENCE)
    }

    /// Drops all hosts and their bytes, because the module has lost its power or the cable has been pulled out.
    pub(super) fn cut(&mut self) {
        *self = Cable { speaker: self.speaker, ..Cable::default() };
    }

    /// True if another host than the speaker has bytes waiting.
    fn others_wait(&self) -> bool {
        self.hosts.iter().any(|host| host.client != self.speaker && !host.waiting.is_empty())
    }

    /// True while an answer is awaited, for at most `patience` since the last byte.
    fn awaits_answer(&self, now: Nanos, patience: Nanos) -> bool {
        self.unanswered > 0 && now < self.last_traffic + patience
    }

    /// The host of a client, which is added if it is new.
    fn host(&mut self, client: Client) -> &mut Host {
        let index = self.hosts.iter().position(|host| host.client == client).unwrap_or_else(|| {
            let (pieces, waiting) = (Pieces::default(), VecDeque::new());
            self.hosts.push(Host { client, pieces, waiting, leaves_traces: false, left: false });
            self.hosts.len() - 1
        });
        &mut self.hosts[index]
    }
}

impl Portion {
    fn leaves_traces(&self) -> bool {
        leaves_traces(&self.bytes)
    }
}

/// True for bytes that may change the state of the connection: the mode, or the subscription to events.
fn leaves_traces(bytes: &[u8]) -> bool {
    const COMMANDS: [u8; 2] = [Opcode::EnterAscii as u8, Opcode::PositionReachedEvent as u8];
    bytes.get(1).is_some_and(|opcode| COMMANDS.contains(opcode)) || contains_bin(bytes)
}

/// True for a telegram that enters ASCII mode, and for a line that leaves it.
fn changes_mode(bytes: &[u8]) -> bool {
    let enters = |telegram: &Telegram| {
        telegram[1] == Opcode::EnterAscii as u8 && telegram[TELEGRAM - 1] == binary::checksum(telegram)
    };
    bytes.try_into().is_ok_and(enters) || matches!(bytes.last(), Some(b'\r' | b'\n')) && contains_bin(bytes)
}

fn contains_bin(bytes: &[u8]) -> bool {
    bytes.windows(3).any(|word| word == b"BIN")
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Client = Client(1);
    const OTHER: Client = Client(2);

    #[test]
    fn hosts_take_turns() {
        let mut cable = Cable::default();
        cable.push(ONE, &[1; 9]);
        cable.push(OTHER, &[2; 9]);
        assert_eq!(cable.next(0).as_deref(), Some(&[1; 9][..]));
        assert_eq!(cable.next(PATIENCE - 1), None);
        assert!(cable.owes(1, ONE) && cable.owes(1, OTHER));
        assert_eq!(cable.hear(1, 9), ONE);
        assert!(!cable.owes(1, ONE));
        assert_eq!(cable.next(1).as_deref(), Some(&[2; 9][..]));
        // Bytes that no host has asked for go to the last speaker.
        assert_eq!((cable.hear(2, 9), cable.hear(3, 9)), (OTHER, OTHER));
    }

    #[test]
    fn a_host_that_gets_no_answer_keeps_the_cable_for_a_while() {
        let mut cable = Cable::default();
        cable.push(ONE, &[1; 9]);
        cable.push(OTHER, &[2; 9]);
        cable.push(ONE, &[3; 9]);
        assert!(cable.next(5).is_some() && cable.next(5).is_none());
        assert_eq!(cable.next(5 + PATIENCE).as_deref(), Some(&[2; 9][..]));
        assert!(cable.owes(5 + PATIENCE, ONE));
    }

    #[test]
    fn the_cable_is_reset_when_a_host_that_changed_the_mode_leaves() {
        let mut cable = Cable::default();
        let enter = [1, 139, 0, 0, 0, 0, 0, 0, 140];
        cable.push(ONE, &enter);
        cable.forget(ONE);
        cable.push(OTHER, &[2; 9]);
        assert_eq!(cable.next(0).as_deref(), Some(&enter[..]));
        assert!(!cable.must_be_reset(0), "the answer is still to come");
        assert_eq!((cable.hear(1, 9), cable.next(1)), (ONE, None));
        assert!(cable.must_be_reset(1));
        assert!(!cable.must_be_reset(1), "once");
        assert_eq!(cable.next(1).as_deref(), Some(&[2; 9][..]));
        cable.hear(2, 9);
        cable.forget(OTHER);
        assert!(!cable.must_be_reset(2), "it has left nothing");
    }

    #[test]
    fn the_session_of_a_host_that_changed_the_mode_ends_when_another_wants_the_cable() {
        let mut cable = Cable::default();
        let enter = [1, 139, 0, 0, 0, 0, 0, 0, 140];
        cable.push(ONE, &enter);
        assert!(cable.next(0).is_some());
        cable.hear(1, 9);
        assert!(!cable.must_be_reset(1), "nobody else is there");
        cable.push(ONE, b"ABIN\r");
        assert!(cable.next(1).is_some());
        cable.hear(2, 9);
        cable.push(OTHER, &[2; 9]);
        assert!(!cable.must_be_reset(2), "it has changed it back");
        assert!(cable.next(2).is_some());
        cable.hear(3, 9);
        cable.push(ONE, &enter);
        assert!(cable.next(3).is_some());
        cable.hear(4, 9);
        cable.push(ONE, b"AGAP");
        cable.silence(ONE);
        assert!(cable.next(4).is_some());
        cable.push(OTHER, &[2; 9]);
        assert!(!cable.must_be_reset(4 + LONE_PATIENCE - 1), "the answer is still to come");
        assert!(cable.must_be_reset(4 + LONE_PATIENCE));
        assert_eq!((cable.take_ended(), cable.take_ended()), (vec![ONE], vec![]));
        assert_eq!(cable.next(4 + GAP).as_deref(), Some(&[2; 9][..]));
    }

    #[test]
    fn cutting_the_cable_drops_all_bytes() {
        let mut cable = Cable::default();
        cable.push(ONE, &[1; 9]);
        cable.push(OTHER, b"2222");
        assert!(cable.next(0).is_some());
        cable.cut();
        assert!(!cable.owes(0, ONE));
        cable.push(OTHER, &[3; 9]);
        assert_eq!(cable.next(0).as_deref(), Some(&[3; 9][..]));
    }

    #[test]
    fn a_silence_of_a_host_is_passed_on_to_the_module() {
        let mut cable = Cable::default();
        cable.push(ONE, b"1234");
        cable.silence(ONE);
        cable.push(ONE, &[1; 9]);
        assert_eq!(cable.next(0).as_deref(), Some(&b"1234"[..]));
        assert_eq!(cable.next(GAP - 1), None);
        assert_eq!(cable.next(GAP).as_deref(), Some(&[1; 9][..]));
    }
}
