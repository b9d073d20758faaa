//! An RS485 bus with the virtual modules and a host on it.
//!
//! Whoever sends is heard by all others with the same bit rate, byte by byte; the host hears everybody. Its own bytes
//! are on the bus the moment it writes them. When two send at once their bytes come mixed, which nobody understands.

use std::collections::VecDeque;

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use tmcm::module::Source;

use crate::client::Client;
use crate::device::{self, Device};

/// Bits of a byte on the wire: start bit, eight data bits, stop bit.
const BITS: u64 = 10;
/// A longer silence between two bytes gives up an unfinished telegram.
const GAP: Nanos = 5 * MILLISECOND;

/// A byte on its way.
#[derive(Debug)]
struct Flight {
    /// When it has arrived.
    at: Nanos,
    from: usize,
    baud: u64,
    byte: u8,
}

/// What a module has to say.
#[derive(Debug)]
struct Message {
    /// Since when.
    ready: Nanos,
    /// How long it has to have heard nothing first.
    pause: Nanos,
    bytes: Vec<u8>,
}

/// A module's place on the bus.
#[derive(Debug, Default)]
struct Place {
    /// One after the other.
    messages: VecDeque<Message>,
    /// When it last heard a byte.
    heard: Nanos,
    /// That byte was the host's.
    host: bool,
    /// Until when it sends; meanwhile it hears nothing.
    sends: Nanos,
}

/// The bus.
#[derive(Debug)]
pub(super) struct Rs485 {
    /// In the order of arrival.
    wire: VecDeque<Flight>,
    places: Vec<Place>,
    /// What the host has heard.
    pub(super) host: VecDeque<u8>,
    /// The host tells its silences itself, since its clock is another one.
    pub(super) told: bool,
}

impl Rs485 {
    pub(super) fn new(modules: usize) -> Self {
        Rs485 {
            wire: VecDeque::new(),
            places: (0..modules).map(|_| Place::default()).collect(),
            host: VecDeque::new(),
            told: false,
        }
    }

    /// The host sends.
    pub(super) fn send(&mut self, modules: &mut [impl Device], now: Nanos, bytes: &[u8]) {
        for (place, module) in self.places.iter_mut().zip(modules) {
            // Silences between what modules and the host say are there for both.
            let told = self.told && std::mem::replace(&mut place.host, true);
            place.hear(module, now, told, |module| module.hear(Source::Rs485, Client::default(), bytes));
        }
    }

    /// The host has been silent for long enough to give up an unfinished telegram, if it is not a reply.
    pub(super) fn silence(&mut self, modules: &mut [impl Device]) {
        for (_, module) in self.places.iter().zip(modules).filter(|(place, _)| place.host) {
            module.silence(Source::Rs485, Client::default());
        }
    }

    /// A module has something to send: after its telegram pause, and what it has said before. Or it has sent it.
    pub(super) fn reply(&mut self, from: usize, module: &impl Device, ready: Nanos, bytes: &[u8]) {
        match (module.rs485(), self.places.get_mut(from)) {
            (Some(device::Rs485 { pause: Some(pause), .. }), Some(place)) => {
                place.messages.push_back(Message { ready, pause, bytes: bytes.to_vec() });
            }
            (Some(device::Rs485 { pause: None, baud }), _) => {
                bytes.iter().for_each(|byte| self.fly(Flight { at: ready, from, baud, byte: *byte }));
            }
            _ => {}
        }
    }

    fn fly(&mut self, flight: Flight) {
        let behind = self.wire.partition_point(|other| other.at <= flight.at);
        self.wire.insert(behind, flight);
    }

    /// A module has lost its power: what it was going to send is not sent.
    pub(super) fn cut_off(&mut self, module: usize) {
        self.wire.retain(|flight| flight.from != module);
        if let Some(place) = self.places.get_mut(module) {
            *place = Place::default();
        }
    }

    /// How many bytes a module still has to begin to send.
    pub(super) fn waiting(&self, module: usize) -> usize {
        let messages = self.places.get(module).into_iter().flat_map(|place| &place.messages);
        messages.map(|message| message.bytes.len()).sum()
    }

    /// When the next byte arrives, or somebody begins to send.
    pub(super) fn next_event(&self) -> Option<Nanos> {
        let starts = self.places.iter().filter_map(Place::starts);
        starts.chain(self.wire.front().map(|flight| flight.at)).min()
    }

    /// Hands out the bytes that have arrived by now.
    pub(super) fn deliver(&mut self, modules: &mut [impl Device], now: Nanos) {
        while let Some(at) = self.next_event().filter(|at| *at <= now) {
            // Who hears something at the last moment does not begin.
            if let Some(flight) = self.wire.pop_front_if(|flight| flight.at == at) {
                self.arrive(modules, &flight);
            } else if let Some(from) = self.places.iter().position(|place| place.starts() == Some(at)) {
                self.begin(modules, from, at);
            }
        }
    }

    fn begin(&mut self, modules: &[impl Device], from: usize, mut at: Nanos) {
        let Some(place) = self.places.get_mut(from) else { return };
        let message = place.messages.pop_front();
        let port = modules.get(from).and_then(Device::rs485);
        let (Some(Message { bytes, .. }), Some(device::Rs485 { baud, .. })) = (message, port) else { return };
        place.sends = at + bytes.len() as u64 * (BITS * SECOND / baud);
        for byte in bytes {
            at += BITS * SECOND / baud;
            self.fly(Flight { at, from, baud, byte });
        }
    }

    fn arrive(&mut self, modules: &mut [impl Device], flight: &Flight) {
        let Flight { at, from, baud, byte } = *flight;
        self.host.push_back(byte);
        for (index, (place, module)) in self.places.iter_mut().zip(modules).enumerate() {
            // At another bit rate it is noise.
            if index != from && module.rs485().is_some_and(|own| own.baud == baud) {
                place.host = false;
                place.hear(module, at, false, |module| module.overhear(byte));
            }
        }
    }
}

impl Place {
    /// When the module begins to send.
    fn starts(&self) -> Option<Nanos> {
        self.messages.front().map(|message| message.ready.max(self.heard + message.pause).max(self.sends))
    }

    fn hear<M: Device>(&mut self, module: &mut M, at: Nanos, told: bool, bring: impl FnOnce(&mut M)) {
        if at < self.sends {
            return;
        }
        if !told && at.saturating_sub(self.heard) > GAP {
            module.silence(Source::Rs485, Client::default());
        }
        self.heard = at;
        bring(module);
    }
}
