//! Requests of links: who is addressed, and what a broken telegram is answered.

use core::task::Poll;

use super::link_settings::{LinkMode, LinkSettings};
use super::origin::{Answer, Origin, Source};
use super::port::Request;
use super::{Module, Platform, Product};
use crate::tmcl::ascii::Line;
use crate::tmcl::binary::Addressed;
use crate::tmcl::{Opcode, Reply, Status, can};
use crate::units::Micros;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Executes a request from a link; returns the answer, and the mode in which a byte link goes on. The link's own
    /// end encodes the reply, with the [`Module::link_settings`] as they are right after this call.
    #[inline(always)]
    pub fn request(&mut self, now: Micros, source: Source, request: &Request) -> (Answer, LinkMode) {
        self.links.update(&self.executor.globals, &self.waiting);
        let restarts = self.device.restart().is_some();
        match request {
            Request::Line(_) if restarts => (Poll::Ready(None), LinkMode::Ascii),
            _ if restarts => (Poll::Ready(None), LinkMode::Binary),
            Request::Telegram(telegram) => self.telegram(now, source, *telegram),
            Request::Line(line) => self.line(now, source, *line),
            Request::Frame(frame) => (self.frame(now, *frame), LinkMode::Binary),
        }
    }

    /// Executes a telegram that is for this module. On the RS485 bus it must carry one of the module's addresses; a
    /// link between one host and the module accepts any. The addressed module answers a wrong checksum with status 1. A
    /// module whose own address is the host's hears the replies of other modules as if they were requests; it
    /// recognises them by the requests before and does not answer.
    #[inline(always)]
    fn telegram(&mut self, now: Micros, source: Source, telegram: Addressed) -> (Answer, LinkMode) {
        let Addressed { address: to, command, intact } = telegram;
        if source == Source::Rs485 {
            let LinkSettings { address, secondary, host, .. } = self.links.settings;
            let [overheard, _] = &mut self.links.overheard;
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
        let ascii = command.opcode == Opcode::EnterAscii as u8 && !T::Product::SPEC.lacks.contains(&Opcode::EnterAscii);
        let mode = if ascii { LinkMode::Ascii } else { LinkMode::Binary };
        (self.obey(now, source.into(), command), mode)
    }

    /// Executes a line of ASCII mode (manual section 3.4). The answer to BIN is still text; binary mode begins after
    /// it.
    #[inline(never)]
    fn line(&mut self, now: Micros, source: Source, line: Line) -> (Answer, LinkMode) {
        let (status, opcode, mode) = match line {
            Line::Command(command) => return (self.obey(now, source.into(), command), LinkMode::Ascii),
            Line::Leave => (Status::Ok, 0, LinkMode::Binary),
            Line::Wrong { status, opcode } => (status, opcode, LinkMode::Ascii),
        };
        let reply = Reply::Plain { status, opcode, value: 0 };
        let answer = if self.executor.globals.suppress(opcode) { Poll::Ready(None) } else { Poll::Ready(Some(reply)) };
        (answer, mode)
    }

    /// Takes a request from the CAN bus. It has one of the module's identifiers (parameters 71 and 83); another one is
    /// not answered.
    ///
    /// Where parameter 70, the identifier of replies, is one of the module's own identifiers, the module receives the
    /// replies of other modules, too. It recognises them by the requests to those modules, so it has to be given all
    /// frames; else frames with other identifiers may be kept from it.
    #[inline(always)]
    fn frame(&mut self, now: Micros, frame: can::Request) -> Answer {
        let can::Request { id, command, length } = frame;
        let LinkSettings { can_id, can_secondary, can_reply, .. } = self.links.settings;
        let [_, overheard] = &mut self.links.overheard;
        if id == can_reply && overheard.is_reply::<AXES>(now, command) {
            return Poll::Ready(None);
        }
        // The second identifier may be that of a group of modules: the others of the group answer as well.
        if id != can_id && id != can_reply {
            let [_, low] = id.as_raw().to_be_bytes();
            overheard.asked::<AXES>(now, low, Some(command));
        }
        if id != can_id && Some(id) != can_secondary {
            return Poll::Ready(None);
        }
        self.obey(now, Origin { source: Source::Can, length }, command)
    }
}
