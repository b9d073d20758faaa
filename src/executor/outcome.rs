//! The outcome of a command, for all who execute one: a link makes a reply of it, a program goes on by it.

use crate::store::Need;
use crate::tmcl::{Command, Reply, Status};

/// The outcome of a command that was not refused; a refused one has a [`Status`](crate::tmcl::Status) instead.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outcome {
    /// Executed; the value of the reply.
    Value(i32),
    /// A motion command was executed.
    Moved {
        /// The value of the reply.
        value: i32,
        /// The axes whose moves and searches have ended with it, axis n in bit n.
        ended: u8,
        /// The axes that have set out to a target or on a search with it, axis n in bit n.
        begun: u8,
    },
    /// A value was read: the value of the reply, and what a program gets into its accumulator.
    Read(i32),
    /// Executed, and answered once it would survive a power cut.
    Stored {
        /// The value of the reply.
        value: i32,
        /// The part of the EEPROM that has to be up to date before the reply.
        need: Need,
        /// The change to take back if writing the EEPROM fails.
        undo: Option<Undo>,
    },
    /// A reply of another form.
    Special(Reply),
    /// Executed; the manual provides no reply.
    Unanswered,
}

impl Outcome {
    /// A setting was stored.
    pub(crate) const fn stored(value: i32) -> Self {
        Outcome::Stored { value, need: Need::Settings, undo: None }
    }

    /// The reply to the command that has led to this, once it is due; `None` where the manual provides none.
    #[inline(always)]
    pub(crate) const fn reply(self, command: Command) -> Option<Reply> {
        match self {
            Outcome::Special(reply) => Some(reply),
            Outcome::Unanswered => None,
            Outcome::Value(value)
            | Outcome::Moved { value, .. }
            | Outcome::Read(value)
            | Outcome::Stored { value, .. } => Some(Reply::Plain { status: Status::Ok, opcode: command.opcode, value }),
        }
    }

    /// Program memory was written.
    pub(crate) const fn written(value: i32) -> Self {
        Outcome::Stored { value, need: Need::Program, undo: None }
    }
}

/// A coordinate as it was before the command that set and stored it: if the EEPROM cannot be written, it comes back.
/// Parameters need no such entry: their values in force are read again from what is stored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Undo {
    pub(crate) axis: u8,
    /// Number of the coordinate, 0 to 20.
    pub(crate) number: u8,
    pub(crate) value: i32,
}
