//! The module's end of a byte link: bytes become requests, replies become bytes, in binary or in ASCII mode.

use heapless::{CapacityError, Vec, VecView};

use super::link_settings::{LinkMode, LinkSettings, ReplyAddresses};
use super::origin::{Origin, Source};
use crate::tmcl::ascii::{self, Editor, Line};
use crate::tmcl::binary::{self, Addressed, Framer};
use crate::tmcl::{Opcode, Reply, can};
use crate::units::Micros;

/// What a link brings the module, decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// In binary mode; whom it is for is checked by the module.
    Telegram(Addressed),
    /// In ASCII mode; it is for this module.
    Line(Line),
    /// From the CAN bus; whom it is for is checked by the module.
    Frame(can::Request),
}

impl Request {
    /// Where it came from, if over this link.
    pub const fn origin(&self, source: Source) -> Origin {
        let length = if let Request::Frame(frame) = self { frame.length } else { 8 };
        Origin { source, length }
    }
}

/// What became of a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken<'a> {
    /// To be sent back at once.
    pub echo: &'a [u8],
    /// What it completes.
    pub request: Option<Request>,
}

/// Room for a reply as it goes over a byte link.
pub type Message = Vec<u8, { ascii::REPLY }>;

/// The state of a byte link. Each link has its own, and with it a mode of its own.
///
/// While the answer to a line, or to the command that may change the mode, is outstanding, it is not known
/// how to read on: as long as [`Port::is_waiting`], bytes are to be kept elsewhere.
#[derive(Clone, Debug)]
pub struct Port {
    /// Others are heard here, too.
    shared: bool,
    mode: LinkMode,
    framer: Framer,
    editor: Editor,
    /// No telegram has come since ASCII mode was left.
    after_text: bool,
    /// Requests without an answer.
    open: u8,
    /// The last of them decides how to read on.
    decides: bool,
}

impl Port {
    /// A link as it starts in a mode.
    pub const fn new(source: Source, mode: LinkMode) -> Self {
        let shared = matches!(source, Source::Rs485);
        Port { shared, mode, framer: Framer::new(), editor: Editor::new(), after_text: false, open: 0, decides: false }
    }

    /// Takes one byte that arrived at `at`. Each request is to be followed by [`Port::answer`]. ASCII mode asks for the
    /// `settings` in force; binary mode needs none, and time is short there.
    pub fn push(&mut self, byte: u8, at: Micros, settings: impl FnOnce() -> LinkSettings) -> Taken<'_> {
        let (echo, request): (&[u8], _) = match self.mode {
            LinkMode::Binary => (&[], self.frame(byte, at).map(Request::Telegram)),
            LinkMode::Ascii => {
                let LinkSettings { address, secondary, host, echo, .. } = settings();
                let own = [address, secondary];
                let echo = if self.shared { echo.among_others(own, host) } else { echo };
                let typed = self.editor.push(byte, own, echo);
                (typed.echo, typed.line.map(Request::Line))
            }
        };
        if let Some(request) = request {
            self.open = self.open.saturating_add(1);
            self.decides = match request {
                Request::Telegram(telegram) => telegram.command.opcode == Opcode::EnterAscii as u8,
                Request::Line(_) | Request::Frame(_) => true,
            };
        }
        Taken { echo, request }
    }

    /// Makes telegrams out of bytes. The last line may have ended with CR and LF: then the LF is no part of the
    /// telegram behind it, where it would be the address 10.
    fn frame(&mut self, byte: u8, at: Micros) -> Option<Addressed> {
        let bytes = self.framer.push(byte, at)?;
        let telegram = binary::decode(&bytes);
        let after_text = core::mem::take(&mut self.after_text);
        match bytes {
            [b'\n', rest @ ..] if after_text && !telegram.intact => {
                // One byte is missing now.
                rest.into_iter().find_map(|byte| self.framer.push(byte, at)).as_ref().map(binary::decode)
            }
            _ => Some(telegram),
        }
    }

    /// True while it is not known how to read on.
    pub const fn is_waiting(&self) -> bool {
        self.decides && self.open > 0
    }

    /// Ends a request with its reply, or without one where `reply` is `None`, or brings the event of command 138, which
    /// ends no request: appends the bytes to be sent to `out`. The link goes on in `mode`, if one is given.
    ///
    /// # Errors
    /// `out` has no room for the reply, which is lost.
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
            (self.mode, self.after_text) = (mode, mode == LinkMode::Binary);
            (self.framer, self.editor) = (Framer::new(), Editor::new());
        }
        encoded
    }

    fn encode(&self, reply: &Reply, addresses: ReplyAddresses, out: &mut VecView<u8>) -> Result<(), CapacityError> {
        let ReplyAddresses { host, module } = addresses;
        match self.mode {
            LinkMode::Binary => out.extend_from_slice(&binary::encode_reply(host, module, reply)),
            LinkMode::Ascii => out.extend_from_slice(&ascii::encode_reply(host, module, reply)),
        }
    }

    /// Gives up waiting for answers that will not come.
    pub const fn give_up(&mut self) {
        self.open = 0;
    }

    /// A silence: an unfinished telegram is given up. What is typed may take its time.
    pub fn silence(&mut self) {
        self.framer.reset();
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

    fn push(port: &mut Port, bytes: &[u8]) -> (std::vec::Vec<u8>, std::vec::Vec<Request>) {
        let (mut echo, mut requests) = (std::vec::Vec::new(), std::vec::Vec::new());
        for byte in bytes {
            let heard = port.push(*byte, Micros(0), settings);
            echo.extend_from_slice(heard.echo);
            requests.extend(heard.request);
        }
        (echo, requests)
    }

    fn answer(port: &mut Port, reply: Option<&Reply>, mode: LinkMode) -> Message {
        let mut message = Message::new();
        port.answer(reply, Some(mode), settings().reply_addresses(), &mut message).unwrap();
        message
    }

    #[test]
    fn there_and_back() {
        let mut port = Port::new(Source::Usb, LinkMode::Binary);
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
