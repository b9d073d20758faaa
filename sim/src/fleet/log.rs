//! The log of a fleet: each telegram and frame on its links, in words, with its virtual time.

use crate::client::Client;
use crate::fleet::{Fleet, Heard, Node};
use crate::module::VirtualModule;
use crate::wire::{CAN, Place, Transcript};

/// The RS485 bus, with one host.
pub(super) const RS485: Place = Place::alone("rs485");
/// The CAN bus, as modules have it.
pub(super) const BUS: Place = Place::alone(CAN);

/// The USB link of a host.
pub(super) const fn usb(client: Client) -> Place {
    if client.is_inquiry() { Place::alone("control") } else { Place::of("usb", client) }
}

impl<M: VirtualModule> Fleet<M> {
    /// Logs from now on what goes over the links, as [`Transcript`] has it: what hosts send when it reaches the modules, and
    /// replies when hosts have them. Two fleets that hear the same at the same virtual times have the same log.
    pub fn log_telegrams(&mut self) {
        self.log = Some(Transcript::of(self.models.iter().copied()));
    }

    /// The lines of the log since the last call; empty without a log.
    pub fn take_telegrams(&mut self) -> String {
        self.log.as_mut().map(Transcript::take).unwrap_or_default()
    }

    /// Logs what has come to the host on the RS485 bus from place `bytes` of what it has heard on, and what is complete on
    /// the CAN bus from place `frames` on.
    pub(super) fn log_buses(&mut self, bytes: usize, frames: usize) {
        let Some(log) = &mut self.log else { return };
        for (at, module, byte) in self.rs485.heard.iter().skip(bytes) {
            log.answer(*at, RS485, *module, &[*byte]);
        }
        for Heard { at, from, frame } in self.can.heard.iter().skip(frames) {
            match *from {
                Node::Module(module) => log.frame(*at, BUS, Some(module), frame),
                Node::Adapter(number) => log.frame(*at, Place::of(CAN, Client(number)), None, frame),
            }
        }
    }
}
