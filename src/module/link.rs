//! Links: who is addressed, what a broken telegram is answered, under which address the reply goes.

use super::port::{Mode, Request};
use super::{Due, Module, Outcome, Platform, Source, Waiter};
use crate::can::StandardId;
use crate::param::{BAUD_RATES, CAN_BIT_RATES, GlobalParameter as G};
use crate::tmcl::ascii::{Echo, Line};
use crate::tmcl::binary::Addressed;
use crate::tmcl::{Opcode, Reply, Status};
use crate::units::Micros;

/// Interface settings in force. They follow the parameters only after the reply to the command that set
/// them, but for the echo, which changes at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Links {
    /// Address on the RS485 bus (parameter 66).
    pub address: u8,
    /// Second address there; 0 for none (parameter 87).
    pub secondary: u8,
    /// Address of the host in replies (parameter 76).
    pub host: u8,
    /// Pause before a reply on RS485, in milliseconds (parameter 75).
    pub pause: u8,
    /// What ASCII mode echoes (parameter 67, bits 4 and 5).
    pub echo: Echo,
    /// The mode byte links start in (parameter 67, bit 0, at the start of the module).
    pub start: Mode,
    /// Identifier of requests on CAN (parameter 71).
    pub can_id: StandardId,
    /// Second identifier of requests there, if there is one (parameter 83).
    pub can_secondary: Option<StandardId>,
    /// Identifier of replies there (parameter 70).
    pub can_reply: StandardId,
}

impl Default for Links {
    fn default() -> Self {
        Links::of(&[0; G::SETTINGS])
    }
}

impl Links {
    pub(super) fn of(globals: &[i32; G::SETTINGS]) -> Self {
        let value = |parameter: G| globals.get(parameter.index()).copied().unwrap_or_default();
        let byte = |parameter| value(parameter) as u8;
        // They have 11 bits.
        let identifier = |parameter| StandardId::new(value(parameter) as u16).unwrap_or(StandardId::MAX);
        Links {
            address: byte(G::SerialAddress),
            secondary: byte(G::SerialSecondaryAddress),
            host: byte(G::SerialHostAddress),
            pause: byte(G::TelegramPause),
            echo: Echo::from_parameter(value(G::AsciiMode)),
            start: if value(G::AsciiMode) & 1 == 0 { Mode::Binary } else { Mode::Ascii },
            can_id: identifier(G::CanId),
            can_secondary: Some(identifier(G::CanSecondaryId)).filter(|id| *id != StandardId::ZERO),
            can_reply: identifier(G::CanReplyId),
        }
    }
}

impl Waiter {
    /// True if it is this link.
    fn is(self, source: Source) -> bool {
        matches!(self, Waiter::Link(from) if from.source == source)
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// The interface settings in force.
    pub const fn links(&self) -> &Links {
        &self.links
    }

    /// The bit rate of RS485 that parameter 65 chooses, in bit/s: the one to start with.
    pub fn baud_rate(&self) -> u32 {
        self.chosen(G::SerialBaudRate, &BAUD_RATES)
    }

    /// The bit rate of CAN that parameter 69 chooses, in bit/s: the one to start with.
    pub fn can_bit_rate(&self) -> u32 {
        self.chosen(G::CanBitRate, &CAN_BIT_RATES)
    }

    /// What a parameter chooses from a list that begins with its smallest value.
    fn chosen(&self, parameter: G, list: &[u32]) -> u32 {
        let first = self.spec().global.row(parameter).and_then(|row| row.ranges.first()).map_or(0, |range| range.0);
        let index = self.global(parameter).saturating_sub(first);
        usize::try_from(index).ok().and_then(|index| list.get(index)).copied().unwrap_or_default()
    }

    /// True while a command of this link waits for its reply: the link is not to bring another one.
    pub fn awaits(&self, source: Source) -> bool {
        self.waiting.iter().any(|waiting| waiting.from.is(source))
    }

    /// The host at the other end of a link is gone: what it waits for is carried out, and told nobody. A download that it
    /// has begun stays open for the next one.
    pub fn forget(&mut self, source: Source) {
        for waiting in self.waiting.iter_mut().filter(|waiting| waiting.from.is(source)) {
            waiting.from = Waiter::Nobody;
        }
        for _ in 0..self.replies.len() {
            if let Some(reply) = self.replies.pop_front().filter(|due| due.to.source != source) {
                // It has just been in there.
                let _ = self.replies.push_back(reply);
            }
        }
        self.subscription = self.subscription.filter(|subscription| subscription.origin.source != source);
    }

    /// Takes a request from a link and says what became of it, and in which mode a byte link goes on. The reply is for
    /// the link's own end to encode, with the [`Module::links`] of this moment.
    pub fn request(&mut self, now: Micros, source: Source, request: &Request) -> (Outcome, Mode) {
        self.update_links();
        let restarts = self.restart.is_some();
        match request {
            Request::Line(_) if restarts => (Outcome::Silent, Mode::Ascii),
            _ if restarts => (Outcome::Silent, Mode::Binary),
            Request::Telegram(telegram) => self.telegram(now, source, *telegram),
            Request::Line(line) => self.line(now, source, *line),
            Request::Frame(frame) => (self.frame(now, *frame), Mode::Binary),
        }
    }

    /// The next of the replies that have become due, oldest first.
    pub fn next_reply(&mut self) -> Option<Due> {
        let due = self.replies.pop_front();
        if due.is_none() {
            // All is said under the old settings.
            self.update_links();
        }
        due
    }

    /// On the RS485 bus a telegram must carry one of the module's addresses; a point-to-point link accepts
    /// any. Whoever is addressed answers a wrong checksum with status 1. A module that has the host's address
    /// knows replies to requests to others when it hears them, and is silent.
    fn telegram(&mut self, now: Micros, source: Source, telegram: Addressed) -> (Outcome, Mode) {
        let Addressed { address: to, command, intact } = telegram;
        if source == Source::Rs485 {
            let Links { address, secondary, host, .. } = self.links;
            let [overheard, _] = &mut self.overheard;
            if to == host && overheard.is_reply(now, command) {
                return (Outcome::Silent, Mode::Binary);
            }
            // Who shares a second address answers, too.
            if to != address && to != host {
                overheard.asked(now, to, intact.then_some(command));
            }
            if to != address && (secondary == 0 || to != secondary) {
                return (Outcome::Silent, Mode::Binary);
            }
        }
        if !intact {
            return (Outcome::Reply(Reply::WRONG_CHECKSUM), Mode::Binary);
        }
        let mode = if command.opcode == Opcode::EnterAscii as u8 { Mode::Ascii } else { Mode::Binary };
        (self.execute(now, source, command), mode)
    }

    /// A line in ASCII mode (manual section 3.4). BIN is answered as text, as everything is that was asked in
    /// ASCII mode.
    fn line(&mut self, now: Micros, source: Source, line: Line) -> (Outcome, Mode) {
        let (status, opcode, mode) = match line {
            Line::Command(command) => return (self.execute(now, source, command), Mode::Ascii),
            Line::Leave => (Status::Ok, 0, Mode::Binary),
            Line::Wrong { status, opcode } => (status, opcode, Mode::Ascii),
        };
        let reply = Reply::Plain { status, opcode, value: 0 };
        let outcome = if self.suppressed(opcode) { Outcome::Silent } else { Outcome::Reply(reply) };
        (outcome, mode)
    }

    /// Lets the interface settings follow the parameters, unless a reply is still to go out under the old
    /// ones.
    pub(super) fn update_links(&mut self) {
        if self.links_stale {
            self.renew_links();
        }
    }

    /// Apart, because each request comes by here, and few change a parameter.
    #[cold]
    fn renew_links(&mut self) {
        if self.waiting.iter().all(|waiting| !matches!(waiting.from, Waiter::Link(_))) && self.replies.is_empty() {
            self.links = Links { start: self.links.start, ..Links::of(&self.globals) };
            self.links_stale = false;
        }
        self.links.echo = Echo::from_parameter(self.global(G::AsciiMode));
    }
}
