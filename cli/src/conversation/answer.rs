//! What nine bytes say in answer to a command.

use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::{Command, Opcode, Status};

/// A reply, read with the command in mind that it answers: some have a form of their own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The usual form: status and value.
    Plain(Received),
    /// The version string: command 136, type 0.
    Version(String),
    /// A command out of program memory: command 134.
    Memory(Command),
    /// Nothing that answers this command, or a wrong checksum.
    Strange,
}

impl Answer {
    /// Reads the reply to `command`.
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

/// A telegram that the module could not read is refused without its number.
fn refuses_checksum(reply: &Received) -> bool {
    reply.opcode == 0 && reply.status() == Some(Status::WrongChecksum)
}

/// The replies that have a shape of their own.
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

/// Bytes as people read them.
pub(crate) fn hexadecimal(telegram: &Telegram) -> String {
    telegram.map(|byte| format!("{byte:02X}")).join(" ")
}
