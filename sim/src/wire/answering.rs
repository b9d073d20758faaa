//! Requests of TMCL that get a reply, and messages of a module that are none.

use tmcm::tmcl::binary::{self, Telegram};
use tmcm::tmcl::{CONFIRMATION, Command, Opcode, Status};

/// True for commands that a module executes without a reply: it starts anew instead.
pub fn stays_unanswered(command: Command) -> bool {
    match Opcode::from_number(command.opcode) {
        Some(Opcode::FactorySettings) => command.value == CONFIRMATION,
        Some(Opcode::EnterBootloader) => command == Command::ENTER_BOOTLOADER,
        _ => false,
    }
}

/// True for a whole telegram with such a command. One with a wrong checksum gets a reply that says so.
pub(crate) fn is_silent_telegram(telegram: &Telegram) -> bool {
    binary::decode_command(telegram).is_some_and(stays_unanswered)
}

/// True for status and command number of the event of command 138, which no request is answered with.
pub(crate) fn is_event(status: u8, opcode: u8) -> bool {
    status == Status::PositionReached as u8 && opcode == Opcode::PositionReachedEvent as u8
}
