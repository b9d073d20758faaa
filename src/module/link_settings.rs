//! The settings of the links: addresses, identifiers, pauses, and the language that a byte link speaks.
//!
//! The module has them ([`Module::link_settings`](super::Module::link_settings)); each call that needs them gets a
//! reference.

use super::origin::Origin;
use crate::can::{Frame, StandardId};
use crate::executor::Globals;
use crate::param::GlobalParameter as G;
use crate::tmcl::ascii::Echo;
use crate::tmcl::{Reply, can};

/// The language of a byte link (manual section 3.4.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkMode {
    /// Telegrams of nine bytes.
    #[default]
    Binary,
    /// Lines of text.
    Ascii,
}

/// The link settings in force. They follow the global parameters only after the reply to the command that sets the
/// parameter, but for the echo, which changes at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkSettings {
    /// Address of the module on the RS485 bus (parameter 66), 1 to 255.
    pub address: u8,
    /// Second address of the module there; 0 for none (parameter 87).
    pub secondary: u8,
    /// Address of the host in replies (parameter 76).
    pub host: u8,
    /// Pause before a reply on RS485, in milliseconds (parameter 75).
    pub pause: u8,
    /// The characters that ASCII mode echoes (parameter 67, bits 4 and 5).
    pub echo: Echo,
    /// The mode in which byte links start (parameter 67, bit 0, as it was at the start of the module).
    pub start: LinkMode,
    /// Identifier of requests on CAN (parameter 71).
    pub can_id: StandardId,
    /// Second identifier of requests on CAN, if the module has one (parameter 83).
    pub can_secondary: Option<StandardId>,
    /// Identifier of replies on CAN (parameter 70).
    pub can_reply: StandardId,
}

/// The two addresses at the head of a reply on a byte link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReplyAddresses {
    /// The host's.
    pub host: u8,
    /// The module's.
    pub module: u8,
}

impl Default for LinkSettings {
    fn default() -> Self {
        LinkSettings::of(&Globals::default())
    }
}

impl LinkSettings {
    pub(super) fn of(globals: &Globals) -> Self {
        let value = |parameter| globals.get(parameter);
        let byte = |parameter| value(parameter) as u8;
        // The rows of these parameters end at 2047, the largest identifier of 11 bits.
        let identifier = |parameter| StandardId::new(value(parameter) as u16).unwrap_or(StandardId::MAX);
        LinkSettings {
            address: byte(G::SerialAddress),
            secondary: byte(G::SerialSecondaryAddress),
            host: byte(G::SerialHostAddress),
            pause: byte(G::TelegramPause),
            echo: Echo::from_parameter(value(G::AsciiMode)),
            start: if value(G::AsciiMode) & 1 == 0 { LinkMode::Binary } else { LinkMode::Ascii },
            can_id: identifier(G::CanId),
            can_secondary: Some(identifier(G::CanSecondaryId)).filter(|id| *id != StandardId::ZERO),
            can_reply: identifier(G::CanReplyId),
        }
    }

    /// The addresses that a reply on a byte link carries.
    pub const fn reply_addresses(&self) -> ReplyAddresses {
        ReplyAddresses { host: self.host, module: self.address }
    }

    /// A reply as a frame: it has identifier 70, as many bytes as the request, and the low byte of identifier 71 in it,
    /// whichever identifier the request came under.
    #[inline]
    pub fn frame(&self, to: Origin, reply: &Reply) -> Frame {
        can::reply_frame(self.can_id, self.can_reply, to.length, reply)
    }
}
