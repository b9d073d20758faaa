//! Byte links: who is addressed, what a broken telegram is answered, under which address the reply goes.

use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;

use super::{Module, Outcome, Source, UserFunctions};
use crate::param::GlobalParameter as G;
use crate::tmcl::Reply;
use crate::tmcl::binary::{self, Telegram};
use crate::units::Micros;

/// Interface settings in force. They follow the parameters only after the reply to the command that set
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Links {
    /// Address on the RS485 bus (parameter 66).
    pub address: u8,
    /// Second address there; 0 for none (parameter 87).
    pub secondary: u8,
    /// Address of the host in replies (parameter 76).
    pub host: u8,
    /// Pause before a reply on RS485, in milliseconds (parameter 75).
    pub pause: u8,
}

impl Links {
    pub(super) fn of(globals: &[i32; G::COUNT]) -> Self {
        let byte = |parameter: G| globals.get(parameter.index()).copied().unwrap_or_default() as u8;
        Links {
            address: byte(G::SerialAddress),
            secondary: byte(G::SerialSecondaryAddress),
            host: byte(G::SerialHostAddress),
            pause: byte(G::TelegramPause),
        }
    }
}

/// The answer to a telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Send this.
    Now(Telegram),
    /// It comes by [`Module::next_telegram`].
    Later,
    /// There is none.
    None,
}

impl<M: SpiDevice, D: SpiDevice, E: OutputPin, U: UserFunctions, const AXES: usize> Module<M, D, E, U, AXES> {
    /// The interface settings in force.
    pub const fn links(&self) -> &Links {
        &self.links
    }

    /// True while a command of this link waits for its reply: the link is not to bring another one.
    pub fn awaits(&self, source: Source) -> bool {
        self.waiting.iter().any(|waiting| waiting.source == source)
    }

    /// Takes a telegram from a byte link. On the RS485 bus it must carry one of the module's addresses; a
    /// point-to-point link accepts any. Whoever is addressed answers a wrong checksum with status 1.
    pub fn serial(&mut self, now: Micros, source: Source, telegram: &Telegram) -> Answer {
        self.update_links();
        let Links { address, secondary, .. } = self.links;
        let [to, ..] = *telegram;
        if source == Source::Rs485 && to != address && (secondary == 0 || to != secondary) {
            return Answer::None;
        }
        let Some(command) = binary::decode_command(telegram) else {
            return Answer::Now(self.encode(&Reply::WRONG_CHECKSUM));
        };
        match self.execute(now, source, command) {
            Outcome::Reply(reply) => Answer::Now(self.encode(&reply)),
            Outcome::Pending => Answer::Later,
            Outcome::Silent => Answer::None,
        }
    }

    /// A telegram that has become due, and the byte link it goes to.
    pub fn next_telegram(&mut self) -> Option<(Source, Telegram)> {
        let (source, reply) = self.next_reply()?;
        Some((source, self.encode(&reply)))
    }

    /// Lets the interface settings follow the parameters, unless a reply is still to go out under the old
    /// ones.
    pub(super) fn update_links(&mut self) {
        if self.waiting.is_empty() && self.replies.is_empty() {
            self.links = Links::of(&self.globals);
        }
    }

    fn encode(&self, reply: &Reply) -> Telegram {
        binary::encode_reply(self.links.host, self.links.address, reply)
    }
}
