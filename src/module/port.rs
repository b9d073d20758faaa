//! The module's end of a byte link: bytes become requests, replies become bytes, in binary or in ASCII mode.

use heapless::{CapacityError, Vec, VecView};

use super::link_settings::{LinkMode, LinkSettings, ReplyAddresses};
use super::origin::{Origin, Source};
use crate::tmcl::ascii::{self, Editor, Line};
use crate::tmcl::binary::{self, Addressed, Framer};
use crate::tmcl::{Opcode, Reply, can};
use crate::units::Micros;

/// A request that a link has brought, decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// A telegram of binary mode. The module checks whether its address is one of its own.
    Telegram(Addressed),
    /// A line of ASCII mode; the editor has dropped lines to other modules.
    Line(Line),
    /// A frame of the CAN bus. The module checks whether its identifier is one of its own.
    Frame(can::Request),
}

impl Request {
    /// The origin of the request, given the link that it came over.
    pub const fn origin(&self, source: Source) -> Origin {
        let length = if let Request::Frame(frame) = self { frame.length } else { 8 };
        Origin { source, length }
    }
}

/// A buffer for a reply as it goes over a byte link, in either mode.
pub type Message = Vec<u8, { ascii::REPLY }>;

/// The module's end of one byte link. Each link has a port, and with it a mode of its own.
///
/// The answer to a line, or to a command that may change the mode, decides in which mode the next byte is to be read.
/// So as long as [`LinkPort::is_waiting`], the caller keeps further bytes.
#[derive(Clone, Debug)]
pub struct LinkPort {
    framer: Framer,
    mode: LinkMode,
    /// A request is complete, in the framer or in `line`.
    ready: bool,
    /// The link is a bus on which other modules and their hosts are heard, too.
    shared: bool,
    /// True until the first telegram after ASCII mode was left.
    after_text: bool,
    /// Number of requests that have not been answered.
    open: u8,
    /// The answer to the last of them decides in which mode the next byte is read.
    decides: bool,
    line: Option<Line>,
    editor: Editor,
}

impl LinkPort {
    /// The port of a link that starts in `mode`.
    pub const fn new(source: Source, mode: LinkMode) -> Self {
        let shared = matches!(source, Source::Rs485);
        LinkPort {
            framer: Framer::new(),
            mode,
            ready: false,
            shared,
            after_text: false,
            open: 0,
            decides: false,
            line: None,
            editor: Editor::new(),
        }
    }

    /// Takes one byte that arrived at `at`, and returns the characters to be sent back at once: the echo of ASCII mode.
    /// ASCII mode asks for the `settings` in force; binary mode needs none, and time is short there. If the byte
    /// completes a request, this stays here until [`LinkPort::take`], which has to come before the next byte.
    #[inline(always)]
    pub fn push(&mut self, byte: u8, at: Micros, settings: impl FnOnce() -> LinkSettings) -> &[u8] {
        if self.mode == LinkMode::Ascii {
            return self.type_in(byte, settings);
        }
        if self.framer.push(byte, at) && !(core::mem::take(&mut self.after_text) && self.lacks_a_byte()) {
            self.ready = true;
            self.open = self.open.saturating_add(1);
            self.decides = self.framer.opcode() == Opcode::EnterAscii as u8;
        }
        &[]
    }

    /// Whether the first telegram after ASCII mode lacks its ninth byte. A terminal may have ended the last line with
    /// CR and LF. The line ends at CR, and LF, which would be address 10, is not part of the telegram behind it.
    #[cold]
    #[inline(never)]
    fn lacks_a_byte(&mut self) -> bool {
        let Addressed { address, intact, .. } = self.framer.decode();
        let lacks = address == b'\n' && !intact;
        if lacks {
            self.framer.drop_first();
        }
        lacks
    }

    /// Takes a character of ASCII mode.
    #[cold]
    #[inline(never)]
    fn type_in(&mut self, byte: u8, settings: impl FnOnce() -> LinkSettings) -> &[u8] {
        let LinkSettings { address, secondary, host, echo, .. } = settings();
        let own = [address, secondary];
        let echo = if self.shared { echo.among_others(own, host) } else { echo };
        let typed = self.editor.push(byte, own, echo);
        if typed.line.is_some() {
            (self.line, self.ready, self.decides) = (typed.line, true, true);
            self.open = self.open.saturating_add(1);
        }
        typed.echo
    }

    /// True while the link speaks in telegrams.
    #[inline(always)]
    pub fn is_binary(&self) -> bool {
        self.mode == LinkMode::Binary
    }

    /// True while a request waits to be taken.
    pub const fn is_ready(&self) -> bool {
        self.ready
    }

    /// Takes the request that the last byte has completed, if it has. It is to be followed by [`LinkPort::answer`].
    #[inline(always)]
    pub fn take(&mut self) -> Option<Request> {
        if !core::mem::take(&mut self.ready) {
            return None;
        }
        if self.mode == LinkMode::Ascii {
            return self.take_line();
        }
        Some(Request::Telegram(self.framer.decode()))
    }

    #[cold]
    #[inline(never)]
    fn take_line(&mut self) -> Option<Request> {
        self.line.take().map(Request::Line)
    }

    /// True while an outstanding answer decides in which mode the next byte is to be read.
    pub const fn is_waiting(&self) -> bool {
        self.decides && self.open > 0
    }

    /// Ends a request with its reply, or without one where `reply` is `None`, or brings the event of command 138, which
    /// ends no request. The bytes to be sent are appended to `out`. The link goes on in `mode`, if one is given.
    ///
    /// # Errors
    /// `out` has no room for the reply, which is lost.
    #[inline(always)]
    pub fn answer(
        &mut self,
        reply: Option<&Reply>,
        mode: Option<LinkMode>,
        addresses: ReplyAddresses,
        out: &mut VecView<u8>,
    ) -> Result<(), CapacityError> {
        let encoded = reply.map_or(Ok(()), |reply| self.encode(reply, addresses, out));
        if !reply.is_some_and(Reply::is_event) {
            self.open = self.open.saturating_sub(1);
        }
        if let Some(mode) = mode.filter(|mode| *mode != self.mode) {
            self.change_to(mode);
        }
        encoded
    }

    #[cold]
    #[inline(never)]
    fn change_to(&mut self, mode: LinkMode) {
        (self.mode, self.after_text) = (mode, mode == LinkMode::Binary);
        (self.framer, self.editor) = (Framer::new(), Editor::new());
    }

    #[inline(always)]
    fn encode(&self, reply: &Reply, addresses: ReplyAddresses, out: &mut VecView<u8>) -> Result<(), CapacityError> {
        match *reply {
            Reply::Plain { status, opcode, value } if self.mode == LinkMode::Binary => {
                let ReplyAddresses { host, module } = addresses;
                out.extend_from_slice(&binary::encode_plain(host, module, status, opcode, value))
            }
            _ => self.encode_other(reply, addresses, out),
        }
    }

    /// Any other reply than the one for which time is short.
    #[cold]
    #[inline(never)]
    fn encode_other(
        &self,
        reply: &Reply,
        addresses: ReplyAddresses,
        out: &mut VecView<u8>,
    ) -> Result<(), CapacityError> {
        let ReplyAddresses { host, module } = addresses;
        match self.mode {
            LinkMode::Binary => out.extend_from_slice(&binary::encode_reply(host, module, reply)),
            LinkMode::Ascii => out.extend_from_slice(&ascii::encode_reply(host, module, reply)),
        }
    }

    /// Stops waiting for answers: the requests have been dropped, so none will come.
    pub const fn give_up(&mut self) {
        self.open = 0;
    }

    /// Gives up an unfinished telegram, after a silence on the link. An unfinished line stays: a person may type
    /// slowly.
    pub fn silence(&mut self) {
        if !self.ready {
            self.framer.reset();
        }
        self.after_text = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tmcl::ascii::Echo;
    use crate::tmcl::{Command, Status};

    fn settings() -> LinkSettings {
        LinkSettings { address: 1, host: 2, echo: Echo::Characters, ..LinkSettings::default() }
    }

    fn push(port: &mut LinkPort, bytes: &[u8]) -> (std::vec::Vec<u8>, std::vec::Vec<Request>) {
        let (mut echo, mut requests) = (std::vec::Vec::new(), std::vec::Vec::new());
        for byte in bytes {
            echo.extend_from_slice(port.push(*byte, Micros(0), settings));
            requests.extend(port.take());
        }
        (echo, requests)
    }

    fn answer(port: &mut LinkPort, reply: Option<&Reply>, mode: LinkMode) -> Message {
        let mut message = Message::new();
        port.answer(reply, Some(mode), settings().reply_addresses(), &mut message).unwrap();
        message
    }

    #[test]
    fn there_and_back() {
        let mut port = LinkPort::new(Source::Usb, LinkMode::Binary);
        let get = binary::encode_command(1, Command::new(6, 1, 0, 0));
        let enter = binary::encode_command(1, Command::new(139, 0, 0, 0));
        let ok = Reply::Plain { status: Status::Ok, opcode: 139, value: 0 };
        assert_eq!(push(&mut port, &get).1, [Request::Telegram(binary::decode(&get))]);
        assert!(!port.is_waiting(), "another telegram may follow at once");
        assert_eq!(push(&mut port, &enter).1, [Request::Telegram(binary::decode(&enter))]);
        assert_eq!(answer(&mut port, None, LinkMode::Binary), []);
        assert!(port.is_waiting(), "the answer to the one before decides nothing");
        assert_eq!(answer(&mut port, Some(&ok), LinkMode::Ascii), [2, 1, 100, 139, 0, 0, 0, 0, 242]);
        assert!(!port.is_waiting());
        assert_eq!(push(&mut port, b"\rABIN\r"), (b"ABIN\r".to_vec(), vec![Request::Line(Line::Leave)]));
        assert!(port.is_waiting());
        assert_eq!(answer(&mut port, Some(&ok), LinkMode::Binary), *b"BA 100 0\r");
        assert_eq!(push(&mut port, &get).1, [Request::Telegram(binary::decode(&get))]);
    }
}
