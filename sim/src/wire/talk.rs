//! The talk between a host and the modules on its link: bytes are cut into telegrams and lines, and each reply finds
//! the command that it answers.

use std::collections::VecDeque;

use tmcm::can::{CanFrame, Frame, Id};
use tmcm::tmcl::binary::Telegram;
use tmcm::tmcl::{Command, Opcode, can};

use super::answer::hexadecimal;
use super::tmcl::{self, Fit};
use super::{ascii, canopen};
use crate::native::{FirmwareKind, Product};
use crate::pieces::{Pieces, is_line, is_typed};

/// Most commands that are kept because they may still be answered. Hosts wait for each reply, or send a few ahead.
const WAITING: usize = 16;

/// A telegram, a line or a frame, with what it says.
#[derive(Debug, Default)]
pub(super) struct Said {
    /// The bytes in hexadecimal.
    pub(super) bytes: String,
    pub(super) meaning: String,
    /// The product that the module has told that it is.
    pub(super) product: Option<Product>,
}

impl Said {
    fn new(bytes: &[u8], meaning: String) -> Self {
        Said { bytes: hexadecimal(bytes), meaning, product: None }
    }
}

/// A direction of a link.
#[derive(Debug, Default)]
struct Speaker {
    pieces: Pieces,
    /// True if what came last was a line, or led to ASCII mode.
    types: bool,
}

/// A link, as one host has it.
#[derive(Debug, Default)]
pub(super) struct Talk {
    host: Speaker,
    /// The modules, by index.
    modules: Vec<Speaker>,
    /// Commands that have not been answered, oldest first, each with its address or identifier.
    waiting: VecDeque<(u16, Command)>,
}

impl Talk {
    /// Bytes of the host.
    pub(super) fn host(&mut self, bytes: &[u8]) -> Vec<Said> {
        let pieces = self.host.push(bytes);
        pieces.iter().map(|bytes| Said::new(bytes, self.request(bytes))).collect()
    }

    fn request(&mut self, bytes: &[u8]) -> String {
        match Telegram::try_from(bytes) {
            Ok(telegram) if !is_line(bytes) => {
                let (text, command) = tmcl::telegram(&telegram);
                if let Some(command) = command {
                    self.host.types = command.opcode == Opcode::EnterAscii as u8;
                    self.wait_for(telegram.first().copied().unwrap_or_default().into(), command);
                }
                text
            }
            _ => ascii::request(bytes),
        }
    }

    /// Bytes of a module, which is of this product.
    pub(super) fn module(&mut self, module: usize, product: Option<Product>, bytes: &[u8]) -> Vec<Said> {
        if self.modules.len() <= module {
            self.modules.resize_with(module + 1, Speaker::default);
        }
        let pieces = self.modules.get_mut(module).map(|speaker| speaker.push(bytes)).unwrap_or_default();
        pieces.iter().map(|bytes| self.reply(product, bytes)).collect()
    }

    fn reply(&mut self, product: Option<Product>, bytes: &[u8]) -> Said {
        match Telegram::try_from(bytes) {
            Ok(telegram) if !is_line(bytes) => {
                let command = self.answered(|_, command| tmcl::fit(command, &telegram));
                let told = command.and_then(|command| tmcl::product(command, &telegram));
                Said { product: told, ..Said::new(bytes, tmcl::reply(product, command, &telegram)) }
            }
            _ => Said::new(bytes, ascii::reply(bytes)),
        }
    }

    /// The host waits no longer for a reply of a module: what there is of one, or that there is nothing.
    pub(super) fn give_up(&mut self, module: usize) -> Said {
        self.waiting.clear();
        let torn = self.modules.get_mut(module).and_then(|speaker| speaker.pieces.silence());
        match torn.filter(|bytes| !bytes.is_empty()) {
            Some(bytes) => Said::new(&bytes, tmcl::torn(&bytes)),
            None => Said::new(&[], "no reply".into()),
        }
    }

    /// No byte has come for so long that a telegram ends; what there is of one. A line in ASCII mode goes on.
    pub(super) fn silence(&mut self) -> Option<Said> {
        let held = self.host.pieces.held();
        if held.is_empty() || self.host.types && held.iter().all(|byte| is_typed(*byte)) {
            return None;
        }
        let bytes = self.host.pieces.silence()?;
        Some(Said::new(&bytes, tmcl::torn(&bytes)))
    }

    /// A frame of the host, or of a module of this product; what is on the bus depends on the firmware.
    pub(super) fn frame(&mut self, from: Option<Option<Product>>, firmware: FirmwareKind, frame: &Frame) -> String {
        let id = match frame.id() {
            Id::Standard(id) if !frame.is_remote_frame() || firmware == FirmwareKind::Canopen => id.as_raw(),
            _ => return "no frame for a module".into(),
        };
        match (firmware, from) {
            (FirmwareKind::Canopen, _) => canopen::meaning(id, frame),
            (FirmwareKind::Tmcl, None) => match can::decode_command(frame.data()) {
                Some(command) => {
                    self.wait_for(id, command);
                    tmcl::request(id, command)
                }
                None => format!("{} bytes: no command, which has 7 or 8", frame.data().len()),
            },
            (FirmwareKind::Tmcl, Some(product)) => {
                let told = |id, command| tmcl::reply_in_frame(id, command, frame.data());
                let mut telegram = None;
                let command = self.answered(|id, command| {
                    let reply = told(id, command)?;
                    telegram = Some(reply);
                    tmcl::fit(command, &reply)
                });
                let telegram = command.and(telegram).or_else(|| tmcl::plain_in_frame(frame.data()));
                match telegram {
                    Some(telegram) => tmcl::reply(product, command, &telegram),
                    None => format!("{} bytes: no reply", frame.data().len()),
                }
            }
        }
    }

    fn wait_for(&mut self, address: u16, command: Command) {
        if self.waiting.len() == WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back((address, command));
    }

    /// The command that a reply answers: the first that it fits best.
    /// Those before it have gone unanswered.
    fn answered(&mut self, mut fits: impl FnMut(u16, Command) -> Option<Fit>) -> Option<Command> {
        let fits: Vec<Option<Fit>> = self.waiting.iter().map(|(address, command)| fits(*address, *command)).collect();
        let first = |wanted| fits.iter().position(|fit| *fit == Some(wanted));
        let place = [Fit::Plain, Fit::Special, Fit::Refusal].into_iter().find_map(first)?;
        self.waiting.drain(..=place).next_back().map(|(_, command)| command)
    }
}

impl Speaker {
    fn push(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let pieces = self.pieces.push(bytes);
        if let Some(last) = pieces.last() {
            self.types = is_line(last);
        }
        pieces
    }
}
