//! The RS485 bus: what others send on it, and what the module sends through its transceiver.

use std::collections::VecDeque;

use super::peripheral::Cycles;
use super::serial::{Character, Incoming};
use super::timebase::Timebase;
use super::usart::{Edge, Frame};
use crate::clock::Nanos;

/// The bus with the module's transceiver.
#[derive(Debug, Default)]
pub struct Rs485 {
    /// Since when the transceiver sends.
    sending: Option<Cycles>,
    /// When it has begun and ended to.
    turns: Vec<(Nanos, bool)>,
    /// Characters that others send and have not begun to, in order.
    incoming: VecDeque<Incoming>,
    /// When what others have begun to send ends.
    heard_until: Nanos,
    sent: Vec<Character>,
}

impl Rs485 {
    /// Takes the characters that the module has sent since the last call.
    pub fn take_sent(&mut self) -> Vec<Character> {
        std::mem::take(&mut self.sent)
    }

    /// When the transceiver has begun (true) and ended (false) to send since the last call.
    pub fn take_turns(&mut self) -> Vec<(Nanos, bool)> {
        std::mem::take(&mut self.turns)
    }

    /// How many characters of others have not begun to arrive yet.
    pub(super) fn waiting(&self) -> usize {
        self.incoming.len()
    }

    /// The board has been switched off: what is under way is lost.
    pub(super) fn forget(&mut self) {
        self.sending = None;
        self.incoming.clear();
    }

    /// The transceiver sends, or does not, from cycle `now` on, which is at `time`.
    pub(super) fn direct(&mut self, sends: bool, now: Cycles, time: Nanos) {
        if sends != self.sending.is_some() {
            self.turns.push((time, sends));
        }
        self.sending = if sends { self.sending.or(Some(now)) } else { None };
    }

    /// Others send. What begins before something else has ended follows it.
    pub(super) fn push(&mut self, mut character: Incoming) {
        character.start = character.start.max(self.last_end().unwrap_or(self.heard_until));
        self.incoming.push_back(character);
    }

    /// When others send next.
    #[inline]
    pub(super) fn next_start(&self) -> Option<Nanos> {
        self.incoming.front().map(|character| character.start)
    }

    /// When all that others send has been sent.
    pub(super) fn last_end(&self) -> Option<Nanos> {
        self.incoming.back().map(Incoming::end)
    }

    /// Takes what others begin to send at `now`. Gives it if the port hears it: it is `connected`, and the transceiver
    /// does not send.
    pub(super) fn hear(&mut self, now: Nanos, connected: bool, time: &Timebase) -> Option<Edge> {
        let character = self.incoming.pop_front_if(|character| character.start <= now)?;
        self.heard_until = character.end();
        (connected && self.sending.is_none()).then(|| Edge {
            start: time.cycles(character.start),
            end: time.cycles(character.end()),
            levels: character.levels,
            bits: character.bits,
        })
    }

    /// The port has sent a frame.
    pub(super) fn transmit(&mut self, frame: Frame, time: &Timebase) {
        let driven = self.sending.is_some_and(|since| since <= frame.start);
        let (start, end) = (time.nanos(frame.start), time.nanos(frame.end));
        self.sent.push(Character { start, end, value: frame.value, driven });
    }
}
