//! The log of a fleet: each telegram and frame on its links, in words, with its virtual time.

use hal_sim::clock::Nanos;

use super::can::{Heard, Node};
use crate::client::Client;
use crate::wire::{CAN, Place, Transcript};

/// The RS485 bus, with one host.
pub(super) const RS485: Place = Place::alone("rs485");
/// The CAN bus, as modules have it.
pub(super) const BUS: Place = Place::alone(CAN);

/// The USB link of a host.
pub(super) const fn usb(client: Client) -> Place {
    if client.is_inquiry() { Place::alone("control") } else { Place::of("usb", client) }
}

/// Logs what has come to the host on the RS485 bus, each byte with its time and the index of its module. On the CAN bus
/// it logs frames that are complete.
pub(super) fn log_buses<'a>(
    log: &mut Transcript,
    bytes: impl Iterator<Item = &'a (Nanos, usize, u8)>,
    frames: impl Iterator<Item = &'a Heard>,
) {
    for (at, module, byte) in bytes {
        log.answer(*at, RS485, *module, &[*byte]);
    }
    for Heard { at, from, frame } in frames {
        match *from {
            Node::Module(module) => log.frame(*at, BUS, Some(module), frame),
            Node::Adapter(number) => log.frame(*at, Place::of(CAN, Client(number)), None, frame),
        }
    }
}
