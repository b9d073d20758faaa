//! Links: who is addressed, what a broken telegram is answered, under which address the reply goes.

use core::task::Poll;

use super::link_settings::{LinkMode, LinkSettings};
use super::origin::{Answer, Due, Source};
use super::port::Request;
use super::waiting::Waiter;
use super::{Module, Platform};
use crate::param::{BAUD_RATES, CAN_BIT_RATES, GlobalParameter as G};
use crate::tmcl::ascii::{Echo, Line};
use crate::tmcl::binary::Addressed;
use crate::tmcl::{Opcode, Reply, Status};
use crate::units::Micros;

impl Waiter {
    /// True for a host on this link.
    fn is_on(self, source: Source) -> bool {
        matches!(self, Waiter::Link(from) if from.source == source)
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// The link settings in force.
    pub const fn link_settings(&self) -> &LinkSettings {
        &self.link_settings
    }

    /// The bit rate of RS485 that parameter 65 chooses, in bit/s. It is taken at the start of the module.
    pub fn baud_rate(&self) -> u32 {
        self.chosen(G::SerialBaudRate, &BAUD_RATES)
    }

    /// The bit rate of CAN that parameter 69 chooses, in bit/s. It is taken at the start of the module.
    pub fn can_bit_rate(&self) -> u32 {
        self.chosen(G::CanBitRate, &CAN_BIT_RATES)
    }

    /// The entry of `list` that a parameter chooses; its smallest value chooses the first entry.
    fn chosen(&self, parameter: G, list: &[u32]) -> u32 {
        let first = self.spec().global.row(parameter).and_then(|row| row.ranges.first()).map_or(0, |range| range.0);
        let index = self.global(parameter).saturating_sub(first);
        usize::try_from(index).ok().and_then(|index| list.get(index)).copied().unwrap_or_default()
    }

    /// True while a command of this link waits for its reply: the link is not to bring another one.
    pub fn awaits(&self, source: Source) -> bool {
        !self.waiting.is_empty() && self.owes(source)
    }

    /// A function of its own, marked as cold: it is asked for each link before each request, and seldom something waits.
    #[cold]
    #[inline(never)]
    fn owes(&self, source: Source) -> bool {
        self.waiting.iter().any(|waiting| waiting.from.is_on(source))
    }

    /// Forgets the host at the other end of a link, which is gone: commands of this host that are still waiting are
    /// carried out, but nobody gets their replies. A download that it has begun stays open for the next host.
    pub fn forget(&mut self, source: Source) {
        for waiting in self.waiting.iter_mut().filter(|waiting| waiting.from.is_on(source)) {
            waiting.from = Waiter::Nobody;
        }
        for _ in 0..self.replies.len() {
            if let Some(reply) = self.replies.pop_front().filter(|due| due.to.source != source) {
                // The queue has room: the entry has just been taken out of it.
                let _ = self.replies.push_back(reply);
            }
        }
        self.arrivals.forget(source);
    }

    /// Executes a request from a link; returns the answer, and the mode in which a byte link goes on. The link's own end
    /// encodes the reply, with the [`Module::link_settings`] as they are right after this call.
    #[inline(always)]
    pub fn request(&mut self, now: Micros, source: Source, request: &Request) -> (Answer, LinkMode) {
        self.update_link_settings();
        let restarts = self.device.restart().is_some();
        match request {
            Request::Line(_) if restarts => (Poll::Ready(None), LinkMode::Ascii),
            _ if restarts => (Poll::Ready(None), LinkMode::Binary),
            Request::Telegram(telegram) => self.telegram(now, source, *telegram),
            Request::Line(line) => self.line(now, source, *line),
            Request::Frame(frame) => (self.frame(now, *frame), LinkMode::Binary),
        }
    }

    /// The next of the replies that have become due, oldest first.
    pub fn next_reply(&mut self) -> Option<Due> {
        let due = self.replies.pop_front();
        if due.is_none() {
            // The last reply that had to go out under the old settings has been fetched.
            self.update_link_settings();
        }
        due
    }

    /// Executes a telegram that is for this module. On the RS485 bus it must carry one of the module's addresses; a link
    /// between one host and the module accepts any. The addressed module answers a wrong checksum with status 1. A module
    /// whose own address is the host's hears the replies of other modules as if they were requests; it recognises
    /// them by the requests before and does not answer.
    #[inline(always)]
    fn telegram(&mut self, now: Micros, source: Source, telegram: Addressed) -> (Answer, LinkMode) {
        let Addressed { address: to, command, intact } = telegram;
        if source == Source::Rs485 {
            let LinkSettings { address, secondary, host, .. } = self.link_settings;
            let [overheard, _] = &mut self.overheard;
            if to == host && overheard.is_reply::<AXES>(now, command) {
                return (Poll::Ready(None), LinkMode::Binary);
            }
            // Another module may share the second address and answer as well.
            if to != address && to != host {
                overheard.asked::<AXES>(now, to, intact.then_some(command));
            }
            if to != address && (secondary == 0 || to != secondary) {
                return (Poll::Ready(None), LinkMode::Binary);
            }
        }
        if !intact {
            return (Poll::Ready(Some(Reply::WRONG_CHECKSUM)), LinkMode::Binary);
        }
        let ascii = command.opcode == Opcode::EnterAscii as u8 && !self.spec().lacks.contains(&Opcode::EnterAscii);
        let mode = if ascii { LinkMode::Ascii } else { LinkMode::Binary };
        (self.obey(now, source.into(), command), mode)
    }

    /// Executes a line of ASCII mode (manual section 3.4). The answer to BIN is still text; binary mode begins after it.
    #[inline(never)]
    fn line(&mut self, now: Micros, source: Source, line: Line) -> (Answer, LinkMode) {
        let (status, opcode, mode) = match line {
            Line::Command(command) => return (self.obey(now, source.into(), command), LinkMode::Ascii),
            Line::Leave => (Status::Ok, 0, LinkMode::Binary),
            Line::Wrong { status, opcode } => (status, opcode, LinkMode::Ascii),
        };
        let reply = Reply::Plain { status, opcode, value: 0 };
        let answer = if self.suppressed(opcode) { Poll::Ready(None) } else { Poll::Ready(Some(reply)) };
        (answer, mode)
    }

    /// Lets the link settings follow the global parameters, unless a reply still has to go out under the old ones.
    pub(super) fn update_link_settings(&mut self) {
        if self.link_settings_stale {
            self.renew_link_settings();
        }
    }

    /// A function of its own, marked as cold: every request asks for an update, and few requests change a parameter.
    #[cold]
    fn renew_link_settings(&mut self) {
        if self.waiting.iter().all(|waiting| !matches!(waiting.from, Waiter::Link(_))) && self.replies.is_empty() {
            self.link_settings = LinkSettings { start: self.link_settings.start, ..LinkSettings::of(&self.globals) };
            self.link_settings_stale = false;
        }
        self.link_settings.echo = Echo::from_parameter(self.global(G::AsciiMode));
    }
}
