//! Telegrams, and frames that carry TMCL, in words.

use tmcm::tmcl::binary::{self, Addressed, Received, TELEGRAM, Telegram};
use tmcm::tmcl::{Command, Opcode, Reply, Status};

use super::answer::{Answer, meaning};
use super::answering::is_event;
use super::control;
use super::reply;
use super::words::{Meaning, depends_on_unit_mode};
use crate::native::Product;

/// Host address in the telegrams made of frames, which carry none.
const HOST: u8 = 2;

/// A request to a module at an address, or with an identifier.
pub(super) fn request(address: u16, command: Command) -> String {
    format!("to {address}: {}", control::command(command))
}

/// A request as it came, whether its checksum is right or not.
pub(super) fn telegram(telegram: &Telegram) -> (String, Option<Command>) {
    let Addressed { address, command, intact } = binary::decode(telegram);
    let text = request(address.into(), command);
    if intact { (text, Some(command)) } else { (format!("wrong checksum: {text}"), None) }
}

/// A reply, and if it is known the command that it answers, from a module of this product.
pub(super) fn reply(product: Option<Product>, command: Option<Command>, telegram: &Telegram) -> String {
    let plain = binary::decode_reply(telegram);
    let from = |text: &str| match plain {
        Some(Received { module, .. }) => format!("from {module}: {text}"),
        None => text.to_owned(),
    };
    let Some(command) = command else {
        return match plain {
            Some(Received { status, opcode, .. }) if is_event(status, opcode) => {
                from(&format!("event, {}", meaning(status)))
            }
            // A telegram with a wrong checksum is not trusted, and so no request that could be known.
            Some(Received { status, opcode: 0, .. }) => from(&format!("status {status} {}", meaning(status))),
            Some(Received { status, opcode, value, .. }) => {
                from(&format!("to command {opcode}: {value}, status {status} {}", meaning(status)))
            }
            None => "wrong checksum".into(),
        };
    };
    match Answer::read(command, telegram) {
        Answer::Version(text) => format!("version {text}"),
        Answer::Memory(stored) => format!("stored {stored}"),
        Answer::Strange => "wrong checksum".into(),
        Answer::Plain(_) => {
            let mut reply = reply::Reply::read(product, false, command, telegram);
            // The unit depends on a setting of the axis that is not on the wire.
            if depends_on_unit_mode(product, command) {
                reply.unit = "";
            }
            from(&Meaning::from(&reply).text)
        }
    }
}

/// The product that a module has told that it is, in the reply to command 136, type 1.
pub(super) fn product(command: Command, telegram: &Telegram) -> Option<Product> {
    let asked = (command.opcode, command.kind) == (Opcode::FirmwareVersion as u8, 1);
    let Received { value, .. } = binary::decode_reply(telegram).filter(|_| asked)?;
    Product::numbered((value >> 16) as u16)
}

/// How well a telegram fits a command as its reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    /// The telegram has the number of the command.
    Plain,
    /// The telegram has a form of its own, which has no room for the number.
    Special,
    /// The telegram refuses a checksum, and so knows no number.
    Refusal,
}

/// Whether a telegram may be the reply to a command.
pub(super) fn fit(command: Command, telegram: &Telegram) -> Option<Fit> {
    match Answer::read(command, telegram) {
        Answer::Plain(Received { status, opcode, .. }) => {
            let fit = if opcode == command.opcode { Fit::Plain } else { Fit::Refusal };
            Status::from_number(status).filter(|_| !is_event(status, opcode)).map(|_| fit)
        }
        Answer::Version(_) | Answer::Memory(_) => Some(Fit::Special),
        Answer::Strange => None,
    }
}

/// The telegram of a frame's data if they are the reply of the module with identifier `id` to `command`; else `None`.
pub fn reply_in_frame(id: u16, command: Command, data: &[u8]) -> Option<Telegram> {
    let [_, id] = id.to_be_bytes();
    let [module, _, opcode, ..] = *data else { return None };
    let answers = module == id && opcode == command.opcode;
    match (Opcode::from_number(command.opcode), command.kind) {
        (Some(Opcode::FirmwareVersion), 0) => {
            Some(binary::encode_reply(HOST, id, &Reply::Version(data.try_into().ok()?)))
        }
        (Some(Opcode::ReadMemory), _) if !answers => {
            let stored = Command::from_bytes(*data.first_chunk()?);
            Some(binary::encode_reply(HOST, id, &Reply::Memory(stored)))
        }
        _ if answers => plain_in_frame(data),
        _ => None,
    }
}

/// The telegram of a frame's data, taken for a reply of the usual form; `None` if they are too few.
pub(super) fn plain_in_frame(data: &[u8]) -> Option<Telegram> {
    let [module, status, opcode, a, b, c, d] = *data.first_chunk()?;
    let mut telegram: Telegram = [HOST, module, status, opcode, a, b, c, d, 0];
    let sum = binary::checksum(&telegram);
    let [.., last] = &mut telegram;
    *last = sum;
    Some(telegram)
}

/// The mistake in bytes that are no telegram.
pub(super) fn torn(bytes: &[u8]) -> String {
    format!("torn: {} of {TELEGRAM} bytes", bytes.len())
}
