//! Replies and their status codes (manual section 3.2).

use super::Command;

/// Status of a reply (manual section 3.2.1). It is as wide as a value, so that the compiler returns either of them in
/// registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Status {
    /// Successfully executed.
    Ok = 100,
    /// Command loaded into program memory.
    Loaded = 101,
    /// The event of command 138: target position reached (manual section 3.7.37).
    PositionReached = 128,
    /// Wrong checksum.
    WrongChecksum = 1,
    /// Unknown command number.
    InvalidCommand = 2,
    /// Unknown type, or a write to something read-only.
    WrongType = 3,
    /// Value, motor or bank out of range.
    InvalidValue = 4,
    /// The configuration EEPROM cannot be written.
    EepromLocked = 5,
    /// The command exists but not in this mode or state.
    NotAvailable = 6,
}

impl Status {
    /// The status with this number, if the protocol has one.
    pub const fn from_number(number: u8) -> Option<Self> {
        Some(match number {
            100 => Status::Ok,
            101 => Status::Loaded,
            128 => Status::PositionReached,
            1 => Status::WrongChecksum,
            2 => Status::InvalidCommand,
            3 => Status::WrongType,
            4 => Status::InvalidValue,
            5 => Status::EepromLocked,
            6 => Status::NotAvailable,
            _ => return None,
        })
    }

    /// The meaning of the status in English words.
    pub const fn meaning(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::Loaded => "loaded into program memory",
            Status::PositionReached => "target position reached",
            Status::WrongChecksum => "wrong checksum",
            Status::InvalidCommand => "unknown command",
            Status::WrongType => "unknown type, or read-only",
            Status::InvalidValue => "value, motor or bank out of range",
            Status::EepromLocked => "EEPROM cannot be written",
            Status::NotAvailable => "not available in this mode or state",
        }
    }
}

/// An answer to one command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Status, command number and value: the reply to every command but two.
    Plain {
        /// Success, or the reason of the refusal.
        status: Status,
        /// Number of the command answered; 0 after a wrong checksum.
        opcode: u8,
        /// The value that was read, else the value of the request.
        value: i32,
    },
    /// Reply to command 136, type 0: after the host address eight characters take the rest of the telegram.
    Version([u8; 8]),
    /// Reply to command 134: a command out of program memory takes the place of module address, status, command number
    /// and value.
    Memory(Command),
}

impl Reply {
    /// A plain reply that repeats the value of `command`.
    pub const fn echo(status: Status, command: Command) -> Self {
        Reply::Plain { status, opcode: command.opcode, value: command.value }
    }

    /// True for the position-reached event that command 138 has asked for: a reply sent later, without a request.
    pub const fn is_event(&self) -> bool {
        matches!(self, Reply::Plain { status: Status::PositionReached, .. })
    }

    /// The reply to a telegram with a wrong checksum. Command number and value are 0, because no byte of the telegram
    /// can be trusted.
    pub const WRONG_CHECKSUM: Reply = Reply::Plain { status: Status::WrongChecksum, opcode: 0, value: 0 };
}
