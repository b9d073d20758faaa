//! A module's reply, decoded by the command that it answers.

use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::{Command, Opcode, Status};

/// A decoded reply. Commands 134 and 136 have replies of their own form, so decoding needs the command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Status and value.
    Plain(Received),
    /// The version string: reply to command 136, type 0.
    Version(String),
    /// A command out of program memory: reply to command 134.
    Memory(Command),
    /// A reply to another command, or a wrong checksum.
    Strange,
}

impl Answer {
    /// Decodes the reply to `command`.
    pub fn read(command: Command, reply: &Telegram) -> Self {
        if let Some(special) = special(command, reply) {
            return special;
        }
        match binary::decode_reply(reply) {
            Some(plain) if plain.opcode == command.opcode || refuses_checksum(&plain) => Answer::Plain(plain),
            _ => Answer::Strange,
        }
    }
}

/// True for the reply to a request that reached the module with a wrong checksum; it does not carry the command's
/// number.
fn refuses_checksum(reply: &Received) -> bool {
    reply.opcode == 0 && reply.status() == Some(Status::WrongChecksum)
}

/// The reply to a command whose replies have a form of their own; `None` if `reply` has the plain form.
fn special(command: Command, reply: &Telegram) -> Option<Answer> {
    match (Opcode::from_number(command.opcode)?, command.kind) {
        (Opcode::FirmwareVersion, 0) => {
            let (_, characters) = reply.split_first()?;
            let printable = characters.iter().all(|byte| (b' '..=b'~').contains(byte));
            printable.then(|| Answer::Version(String::from_utf8_lossy(characters).into_owned()))
        }
        (Opcode::ReadMemory, _) => {
            let plain = binary::decode_reply(reply);
            let refused = plain.is_none_or(|reply| reply.opcode == command.opcode && reply.status().is_some());
            binary::decode_command(reply).filter(|_| !refused).map(Answer::Memory)
        }
        _ => None,
    }
}

/// True for the statuses of a command that was executed or stored in program memory.
pub fn executed(status: u8) -> bool {
    matches!(Status::from_number(status), Some(Status::Ok | Status::Loaded))
}

/// The meaning of a status in words.
pub fn meaning(status: u8) -> &'static str {
    Status::from_number(status).map_or("a status this program does not know", Status::meaning)
}

/// Bytes in hexadecimal, with spaces between them.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}
