//! What is asked over a link, and whose reply is one to it.

use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{self, Telegram};
use tmcm_sim::wire::Answer;

/// A command for a module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question {
    /// The address of the module.
    pub(super) address: u8,
    pub(super) command: Command,
    /// A reply is taken whatever module it is from.
    pub(super) takes_any: bool,
}

impl Question {
    /// The request as it goes over the link.
    pub(super) fn telegram(&self) -> Telegram {
        binary::encode_command(self.address, self.command)
    }

    /// The address of another module from which this reply is; `None` for one to take. Replies of a form of their own, and
    /// bytes that are no reply, carry no address.
    pub(super) fn other(&self, reply: &Telegram) -> Option<u8> {
        match Answer::read(self.command, reply) {
            Answer::Plain(reply) if !self.takes_any && reply.module != self.address => Some(reply.module),
            _ => None,
        }
    }
}
