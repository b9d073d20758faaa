//! The USB cable of a module that runs its image: several hosts share what is one serial port to the module.
//!
//! The module does not know who speaks. A host has the cable until as much has come back as it has said, as it is with
//! telegrams, or nothing has moved for a while; what comes back meanwhile is for it. Then it is the next one's turn, for one
//! telegram or line.
//!
//! To the module there is one connection, whoever comes and goes. What a host leaves behind in it - another language than
//! that of parameter 67, a subscription - would be the next one's. So when a host that has asked for something of the kind
//! is gone, the cable is reset, and for those who are still there the link is as after its start, too.
//!
//! Nor can others speak while one that stays has made the module change its language. As soon as one of them wants to, the
//! session of that one is over: it is taken for gone, and its connection is closed.

use std::collections::VecDeque;

use hal_sim::clock::{MILLISECOND, Nanos};
use tmcm::tmcl::Opcode;
use tmcm::tmcl::binary::{self, TELEGRAM, Telegram};

use super::pieces::Pieces;
use crate::client::Client;

/// A host whose request is not answered has the cable for so long while others want it. Storing takes longer, but that can
/// be seen.
const PATIENCE: Nanos = 40 * MILLISECOND;
/// And for so long while nobody else does.
const LONE_PATIENCE: Nanos = 5 * MILLISECOND;
/// Bytes of a host alone that may be on their way without an answer. The module can take more: they would be carried out
/// before a second host's.
const AHEAD: usize = 3 * TELEGRAM;
/// A silence that the firmware takes for the end of a telegram: it waits for 5 ms.
pub(super) const GAP: Nanos = 6 * MILLISECOND;

/// Bytes that wait for the cable.
#[derive(Debug)]
struct Portion {
    bytes: Vec<u8>,
    /// A silence follows.
    gap: bool,
}

/// One of those who share the cable.
#[derive(Debug)]
struct Host {
    client: Client,
    pieces: Pieces,
    waiting: VecDeque<Portion>,
    /// It has asked for what would outlast it.
    leaves_traces: bool,
    gone: bool,
}

/// The cable.
#[derive(Debug, Default)]
pub(super) struct Cable {
    hosts: Vec<Host>,
    /// Whose turn it is.
    turn: usize,
    /// Who has the cable, or had it last.
    speaker: Client,
    /// How many bytes have not come back.
    missing: usize,
    /// When something last moved.
    moved: Nanos,
    /// Until when nothing is sent.
    quiet: Nanos,
    /// A change of the language is on its way; it has come about once that is answered.
    changing: bool,
    /// Who has made the module speak another language than at its start.
    strayed: Option<Client>,
    /// Whose sessions have been ended since that was last asked for.
    ended: Vec<Client>,
}

impl Cable {
    /// Bytes from a host.
    pub(super) fn push(&mut self, client: Client, bytes: &[u8]) {
        let host = self.host(client);
        for bytes in host.pieces.push(bytes) {
            host.leaves_traces |= leaves_traces(&bytes);
            host.waiting.push_back(Portion { bytes, gap: false });
        }
    }

    /// A host is silent.
    pub(super) fn silence(&mut self, client: Client) {
        let host = self.host(client);
        host.waiting.extend(host.pieces.silence().map(|bytes| Portion { bytes, gap: true }));
    }

    /// A host has gone.
    pub(super) fn forget(&mut self, client: Client) {
        let host = self.host(client);
        host.gone = true;
        // A reset ends what was half said, too.
        if !host.leaves_traces {
            self.silence(client);
        }
    }

    /// True if somebody has left what the next one must not find: the cable is to be reset. Told once, when nobody waits for
    /// an answer.
    pub(super) fn is_left_behind(&mut self, now: Nanos) -> bool {
        let stays = |client: &Client| self.hosts.iter().any(|host| host.client == *client && !host.gone);
        let in_the_way = self.strayed.filter(|client| self.others_wait() && stays(client));
        // What it is still to hear is of little use to it.
        if self.is_taken(now, if in_the_way.is_some() { LONE_PATIENCE } else { PATIENCE }) {
            return false;
        }
        if let Some(client) = in_the_way {
            let host = self.host(client);
            (host.gone, host.leaves_traces) = (true, true);
            host.waiting.clear();
            self.ended.push(client);
        }
        let left = self.hosts.extract_if(.., |host| host.gone && host.waiting.is_empty());
        let left = left.fold(false, |left, host| left | host.leaves_traces);
        if left {
            (self.missing, self.changing, self.strayed) = (0, false, None);
            self.hosts.iter_mut().for_each(|host| host.leaves_traces = host.waiting.iter().any(Portion::leaves_traces));
        }
        left
    }

    /// The module is storing something: the answer may have to wait for that.
    pub(super) fn wait(&mut self, now: Nanos) {
        self.moved = now;
    }

    /// What goes to the module now.
    pub(super) fn next(&mut self, now: Nanos) -> Option<Vec<u8>> {
        if now < self.quiet {
            return None;
        }
        let speaker = self.speaker;
        let taken = if self.others_wait() {
            self.is_taken(now, PATIENCE)
        } else {
            self.missing >= AHEAD && self.is_taken(now, LONE_PATIENCE)
        };
        if taken {
            return None;
        }
        // Nobody else finds the link as it is now.
        let leaving = self.hosts.iter().any(|host| host.gone && host.leaves_traces);
        let count = self.hosts.len();
        let mut turns = (self.turn..count).chain(0..self.turn.min(count));
        let (index, client, Portion { bytes, gap }) = turns.find_map(|index| {
            let host = self.hosts.get_mut(index).filter(|host| host.gone || !leaving)?;
            Some((index, host.client, host.waiting.pop_front()?))
        })?;
        self.turn = index + 1;
        // What is not answered by now has not come about.
        self.changing = changes_language(&bytes) || self.changing && client == speaker && self.missing > 0;
        self.missing = if client == speaker { self.missing + bytes.len() } else { bytes.len() };
        (self.speaker, self.moved) = (client, now);
        self.quiet = if gap { now + GAP } else { 0 };
        Some(bytes)
    }

    /// So many bytes have come from the module; gives whom they are for.
    pub(super) fn hear(&mut self, now: Nanos, count: usize) -> Client {
        self.missing = self.missing.saturating_sub(count);
        self.moved = now;
        if std::mem::take(&mut self.changing) {
            // There are two.
            self.strayed = if self.strayed.is_some() { None } else { Some(self.speaker) };
        }
        self.speaker
    }

    /// Clients whose sessions have been ended in favour of others since the last call.
    pub(super) fn take_ended(&mut self) -> Vec<Client> {
        std::mem::take(&mut self.ended)
    }

    /// How many bytes of a host wait.
    pub(super) fn unread(&self, client: Client) -> usize {
        let portions = self.hosts.iter().filter(|host| host.client == client).flat_map(|host| &host.waiting);
        portions.map(|portion| portion.bytes.len()).sum()
    }

    /// True while anything of anybody waits.
    pub(super) fn has_unread(&self) -> bool {
        self.hosts.iter().any(|host| host.gone || !host.waiting.is_empty())
    }

    /// True while something of this client's waits or may come back to it.
    pub(super) fn owes(&self, now: Nanos, client: Client) -> bool {
        let waits = self.hosts.iter().any(|host| host.client == client && !host.waiting.is_empty());
        waits || self.speaker == client && self.is_taken(now, PATIENCE)
    }

    /// The module has lost its power, or the cable has been pulled out: nothing comes back any more, and what was half
    /// said is forgotten.
    pub(super) fn cut(&mut self) {
        *self = Cable { speaker: self.speaker, ..Cable::default() };
    }

    /// Somebody else wants the cable than who has it.
    fn others_wait(&self) -> bool {
        self.hosts.iter().any(|host| host.client != self.speaker && !host.waiting.is_empty())
    }

    fn is_taken(&self, now: Nanos, patience: Nanos) -> bool {
        self.missing > 0 && now < self.moved + patience
    }

    fn host(&mut self, client: Client) -> &mut Host {
        let index = self.hosts.iter().position(|host| host.client == client).unwrap_or_else(|| {
            let (pieces, waiting) = (Pieces::default(), VecDeque::new());
            self.hosts.push(Host { client, pieces, waiting, leaves_traces: false, gone: false });
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

/// Changes the language of the link, or subscribes to an event.
fn leaves_traces(bytes: &[u8]) -> bool {
    const COMMANDS: [u8; 2] = [Opcode::EnterAscii as u8, Opcode::PositionReachedEvent as u8];
    bytes.get(1).is_some_and(|opcode| COMMANDS.contains(opcode)) || names_binary(bytes)
}

/// Changes the language of the link, if it is another.
fn changes_language(bytes: &[u8]) -> bool {
    let enters = |telegram: &Telegram| {
        telegram[1] == Opcode::EnterAscii as u8 && telegram[TELEGRAM - 1] == binary::checksum(telegram)
    };
    bytes.try_into().is_ok_and(enters) || matches!(bytes.last(), Some(b'\r' | b'\n')) && names_binary(bytes)
}

fn names_binary(bytes: &[u8]) -> bool {
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
        // Something unasked for goes to who spoke last.
        assert_eq!((cable.hear(2, 9), cable.hear(3, 9)), (OTHER, OTHER));
    }

    #[test]
    fn who_gets_no_answer_has_the_cable_for_a_while() {
        let mut cable = Cable::default();
        cable.push(ONE, &[1; 9]);
        cable.push(OTHER, &[2; 9]);
        cable.push(ONE, &[3; 9]);
        assert!(cable.next(5).is_some() && cable.next(5).is_none());
        assert_eq!(cable.next(5 + PATIENCE).as_deref(), Some(&[2; 9][..]));
        assert!(cable.owes(5 + PATIENCE, ONE));
    }

    #[test]
    fn nobody_finds_what_another_has_left_behind() {
        let mut cable = Cable::default();
        let enter = [1, 139, 0, 0, 0, 0, 0, 0, 140];
        cable.push(ONE, &enter);
        cable.forget(ONE);
        cable.push(OTHER, &[2; 9]);
        assert_eq!(cable.next(0).as_deref(), Some(&enter[..]));
        assert!(!cable.is_left_behind(0), "the answer is still to come");
        assert_eq!((cable.hear(1, 9), cable.next(1)), (ONE, None));
        assert!(cable.is_left_behind(1));
        assert!(!cable.is_left_behind(1), "once");
        assert_eq!(cable.next(1).as_deref(), Some(&[2; 9][..]));
        cable.hear(2, 9);
        cable.forget(OTHER);
        assert!(!cable.is_left_behind(2), "it has left nothing");
    }

    #[test]
    fn who_has_changed_the_language_goes_when_another_wants_the_cable() {
        let mut cable = Cable::default();
        let enter = [1, 139, 0, 0, 0, 0, 0, 0, 140];
        cable.push(ONE, &enter);
        assert!(cable.next(0).is_some());
        cable.hear(1, 9);
        assert!(!cable.is_left_behind(1), "nobody else is there");
        cable.push(ONE, b"ABIN\r");
        assert!(cable.next(1).is_some());
        cable.hear(2, 9);
        cable.push(OTHER, &[2; 9]);
        assert!(!cable.is_left_behind(2), "it has changed it back");
        assert!(cable.next(2).is_some());
        cable.hear(3, 9);
        cable.push(ONE, &enter);
        assert!(cable.next(3).is_some());
        cable.hear(4, 9);
        cable.push(ONE, b"AGAP");
        cable.silence(ONE);
        assert!(cable.next(4).is_some());
        cable.push(OTHER, &[2; 9]);
        assert!(!cable.is_left_behind(4 + LONE_PATIENCE - 1), "the answer is still to come");
        assert!(cable.is_left_behind(4 + LONE_PATIENCE));
        assert_eq!((cable.take_ended(), cable.take_ended()), (vec![ONE], vec![]));
        assert_eq!(cable.next(4 + GAP).as_deref(), Some(&[2; 9][..]));
    }

    #[test]
    fn nothing_is_left_of_what_was_cut() {
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
    fn a_silence_is_one_for_the_module() {
        let mut cable = Cable::default();
        cable.push(ONE, b"1234");
        cable.silence(ONE);
        cable.push(ONE, &[1; 9]);
        assert_eq!(cable.next(0).as_deref(), Some(&b"1234"[..]));
        assert_eq!(cable.next(GAP - 1), None);
        assert_eq!(cable.next(GAP).as_deref(), Some(&[1; 9][..]));
    }
}
