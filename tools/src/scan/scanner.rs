//! The scan of a link at one bit rate.

use std::time::Duration;

use tmcm::tmcl::binary::Received;
use tmcm::tmcl::{Command, Opcode};

use super::found::Found;
use super::search::{Event, Medium, Search};
use crate::conversation::{ASK_VERSION, Conversation, Error};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::stop::Stop;
use crate::wire::LinkError;

/// An address that no module on a bus has. A module that answers a request to this address is alone on its link.
const UNUSED_ADDRESS: u16 = 0;
/// Longest wait for late replies: the longest telegram pause (global parameter 75) of a module.
const LATE: Duration = Duration::from_millis(255);
/// The first request to an address: command 135, because a module in download mode answers it, too, and does not store
/// it.
const ASK_STATE: Command = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);

/// How a scan ended.
pub(super) enum End {
    /// All addresses have been asked.
    Complete,
    /// The link leads to one module, whatever the address.
    SingleModule,
    /// A signal has asked for the end.
    Interrupted,
}

/// The scan of a link at one bit rate.
pub(super) struct Scanner<'a> {
    search: &'a Search,
    module: Conversation,
    /// The bit rate of a serial device in bit/s; `None` for a link without bit rate.
    baud: Option<u32>,
    /// Number of modules that have been found.
    pub(super) modules: usize,
    /// Bytes have come that are no reply.
    pub(super) heard: bool,
    /// Address of the first module that has been found.
    pub(super) first: Option<u16>,
}

impl<'a> Scanner<'a> {
    /// A scan over a link that has been opened, at this bit rate if it has one.
    pub(super) fn new(mut module: Conversation, search: &'a Search, baud: Option<u32>) -> Self {
        module.set_timeout(search.timeout);
        Scanner { search, module, baud, modules: 0, heard: false, first: None }
    }

    pub(super) fn scan<E: From<Failure>>(
        &mut self,
        stop: &dyn Stop,
        hear: &mut impl FnMut(Event<'_, E>) -> Result<(), E>,
    ) -> Result<End, E> {
        let can = self.search.medium == Medium::Can;
        if !can && let Some(reply) = self.alone(stop)? {
            self.module.turn_to(reply.module.into());
            let found = Found { alone: true, address: Some(reply.module.into()), ..self.describe(reply.value)? };
            self.count(reply.module.into());
            hear(Event::Found(&found))?;
            return Ok(End::SingleModule);
        }
        let name = if can { "identifier" } else { "address" };
        let addresses = self.search.addresses.clone();
        let rate = self.baud.map_or_else(String::new, |baud| format!(" at {baud} baud"));
        let what = format!("asking {name} {} to {}{rate}", addresses.start(), addresses.end());
        let total = addresses.len();
        hear(Event::Progress(Progress { what: &what, done: 0, total }))?;
        for (done, address) in addresses.enumerate() {
            if stop.happened() {
                return Ok(End::Interrupted);
            }
            if let Some(reply) = self.find(address, stop)? {
                // On CAN a reply carries only the low byte of the module's identifier.
                let [_, low] = address.to_be_bytes();
                let found = Found {
                    address: (!can).then_some(address),
                    identifier: can.then_some(address),
                    secondary_of: (reply.module != low).then_some(reply.module),
                    ..self.describe(reply.value)?
                };
                self.count(address);
                hear(Event::Found(&found))?;
            }
            hear(Event::Progress(Progress { what: &what, done: done + 1, total }))?;
        }
        Ok(End::Complete)
    }

    /// The version reply of a module that answers whatever the address. For all that it is asked it has as long as for
    /// the first question.
    fn alone(&mut self, stop: &dyn Stop) -> Result<Option<Received>, Failure> {
        self.module.set_timeout(self.search.first_timeout);
        let reply = self.find(UNUSED_ADDRESS, stop)?;
        if reply.is_none() {
            self.module.set_timeout(self.search.timeout);
        }
        Ok(reply)
    }

    /// Counts a module that has been found.
    fn count(&mut self, address: u16) {
        self.modules += 1;
        self.first = self.first.or(Some(address));
    }

    /// The version reply of the module at an address; `None` if there is no module. Two requests are sent: the reply to
    /// the first may be a late reply to an earlier address, the reply to the second, with another command number,
    /// cannot.
    pub(super) fn find(&mut self, address: u16, stop: &dyn Stop) -> Result<Option<Received>, Failure> {
        if self.probe(address, ASK_STATE)?.is_none() {
            return Ok(None);
        }
        self.settle(stop);
        let found = self.probe(address, ASK_VERSION)?;
        if found.is_none() {
            self.settle(stop);
        }
        Ok(found)
    }

    /// Waits for late replies. The next request throws them away.
    pub(super) fn settle(&mut self, stop: &dyn Stop) {
        self.module.pause(self.search.timeout.min(LATE), stop);
    }

    /// Sends a request to an address and returns its reply. Bytes that are no reply count as none: they are noise, or
    /// come from several modules that reply at once.
    fn probe(&mut self, address: u16, command: Command) -> Result<Option<Received>, Failure> {
        self.module.turn_to(address);
        match self.module.request(command) {
            Ok(reply) => Ok(Some(reply)),
            Err(Error::Link { error: LinkError::NoReply { bytes: 0 }, .. }) => Ok(None),
            Err(
                Error::Link { error: LinkError::NoReply { .. }, .. } | Error::Refused { .. } | Error::Strange { .. },
            ) => {
                self.heard = true;
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The module that has answered: what it is, and at which bit rate.
    fn describe(&mut self, version: i32) -> Result<Found, Failure> {
        let (product, firmware) = Found::told(version);
        let version = match self.module.version() {
            Ok(text) => Some(text),
            Err(Error::Link { error: error @ (LinkError::Closed | LinkError::Lost(_)), .. }) => {
                return Err(Failure::Failed(error.to_string()));
            }
            Err(_) => None,
        };
        let (address, identifier, secondary_of) = (None, None, None);
        Ok(Found { address, identifier, baud: self.baud, alone: false, secondary_of, product, firmware, version })
    }
}
