//! The virtual RS485 bus of a fleet: the modules and one host.
//!
//! All modules with the sender's bit rate receive what a module sends, byte by byte; the host receives the bytes of
//! every module. The host's own bytes arrive at the moment it writes them. When two modules send at once, their bytes
//! arrive mixed.

use std::collections::VecDeque;

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use tmcm::module::Source;

use crate::client::{Client, Sent};
use crate::module::{self, VirtualModule};

/// Bits of a byte on the wire: start bit, eight data bits, stop bit.
const BITS: u64 = 10;
/// Silence after which a module gives up an unfinished telegram.
const GAP: Nanos = 5 * MILLISECOND;

/// A byte of a module that is being transmitted.
#[derive(Debug)]
struct ByteOnWire {
    /// When the byte is complete.
    at: Nanos,
    /// Index of the module that sends the byte.
    from: usize,
    baud: u64,
    byte: u8,
    /// How many replies to requests end with this byte.
    replies: u64,
}

/// A reply that a module has to send.
#[derive(Debug)]
struct Message {
    /// When the module had the reply ready.
    ready: Nanos,
    /// Silence on the bus that must precede the reply (global parameter 75).
    pause: Nanos,
    bytes: Vec<u8>,
    /// How many replies to requests end with these bytes.
    replies: u64,
}

/// A module as a node of the bus.
#[derive(Debug, Default)]
struct Station {
    /// Replies that have not begun yet, in the order in which they are sent.
    messages: VecDeque<Message>,
    /// When the module last received a byte.
    heard: Nanos,
    /// True if the host sent that byte.
    host_spoke_last: bool,
    /// Until when the module sends; meanwhile its receiver is off.
    sends: Nanos,
}

/// The RS485 bus.
#[derive(Debug)]
pub(super) struct Rs485 {
    /// Bytes that are being transmitted, in the order of arrival.
    wire: VecDeque<ByteOnWire>,
    /// The modules, by index.
    stations: Vec<Station>,
    /// Bytes that the host has received and not taken yet, each with its time and the index of the module that it came
    /// from.
    pub(super) heard: Vec<(Nanos, usize, u8)>,
    /// True if [`Rs485::silence`] is called after the host's telegrams, because the host does not live in virtual time.
    /// Else the modules measure the host's pauses in virtual time.
    pub(super) silences_announced: bool,
}

impl Rs485 {
    pub(super) fn new(modules: usize) -> Self {
        Rs485 {
            wire: VecDeque::new(),
            stations: (0..modules).map(|_| Station::default()).collect(),
            heard: Vec::new(),
            silences_announced: false,
        }
    }

    /// Gives bytes of the host to all modules.
    pub(super) fn send(&mut self, modules: &mut [impl VirtualModule], now: Nanos, bytes: &[u8]) {
        for (station, module) in self.stations.iter_mut().zip(modules) {
            // Between bytes of a module and bytes of the host the pause is measured in virtual time in any case.
            let announced = self.silences_announced && std::mem::replace(&mut station.host_spoke_last, true);
            station.hear(module, now, announced, |module| module.hear(Source::Rs485, Client::default(), bytes));
        }
    }

    /// The host has been silent long enough for the modules to give up an unfinished telegram of the host.
    pub(super) fn silence(&mut self, modules: &mut [impl VirtualModule]) {
        for (_, module) in self.stations.iter().zip(modules).filter(|(station, _)| station.host_spoke_last) {
            module.silence(Source::Rs485, Client::default());
        }
    }

    /// Takes bytes of a module. With a telegram pause given, they are sent after that pause and after the module's
    /// earlier replies. Without one, the module's own UART has sent them already, and they arrive at `ready`.
    pub(super) fn reply(&mut self, from: usize, module: &impl VirtualModule, sent: &Sent) {
        let Some(module::Rs485 { pause, baud }) = module.rs485() else { return };
        let Sent { at: ready, replies, .. } = *sent;
        let message = Message { ready, pause: pause.unwrap_or_default(), bytes: sent.bytes.clone(), replies };
        match self.stations.get_mut(from) {
            Some(station) if pause.is_some() => station.messages.push_back(message),
            _ => self.put_all_on_wire(from, ready, 0, baud, &message),
        }
    }

    /// Puts a message of a module on the wire: its bytes, of which each takes so long, begin at `at`.
    fn put_all_on_wire(&mut self, from: usize, at: Nanos, each: Nanos, baud: u64, message: &Message) {
        let Message { bytes, replies, .. } = message;
        for (count, byte) in (1..).zip(bytes) {
            let replies = if count == bytes.len() as u64 { *replies } else { 0 };
            self.put_on_wire(ByteOnWire { at: at + count * each, from, baud, byte: *byte, replies });
        }
    }

    fn put_on_wire(&mut self, byte: ByteOnWire) {
        let behind = self.wire.partition_point(|other| other.at <= byte.at);
        self.wire.insert(behind, byte);
    }

    /// Drops the replies of a module that has lost its power.
    pub(super) fn cut_off(&mut self, module: usize) {
        self.wire.retain(|byte| byte.from != module);
        if let Some(station) = self.stations.get_mut(module) {
            *station = Station::default();
        }
    }

    /// Number of bytes in a module's replies that have not begun yet.
    pub(super) fn waiting(&self, module: usize) -> usize {
        let messages = self.stations.get(module).into_iter().flat_map(|station| &station.messages);
        messages.map(|message| message.bytes.len()).sum()
    }

    /// True while a reply to a request is on the wire or waits for it.
    pub(super) fn has_reply(&self) -> bool {
        let messages = self.stations.iter().flat_map(|station| &station.messages);
        messages.map(|message| message.replies).chain(self.wire.iter().map(|byte| byte.replies)).any(|count| count > 0)
    }

    /// When the next byte arrives, or the next reply begins.
    pub(super) fn next_event(&self) -> Option<Nanos> {
        let starts = self.stations.iter().filter_map(Station::starts);
        starts.chain(self.wire.front().map(|byte| byte.at)).min()
    }

    /// Lets all replies begin and all bytes arrive that are due by now. How many replies have come whole.
    pub(super) fn deliver(&mut self, modules: &mut [impl VirtualModule], now: Nanos) -> u64 {
        let mut replies = 0;
        while let Some(at) = self.next_event().filter(|at| *at <= now) {
            // A byte arrives before a reply begins at the same time, because the byte restarts the pause before the
            // reply.
            if let Some(byte) = self.wire.pop_front_if(|byte| byte.at == at) {
                replies += byte.replies;
                self.arrive(modules, &byte);
            } else if let Some(from) = self.stations.iter().position(|station| station.starts() == Some(at)) {
                self.begin(modules, from, at);
            }
        }
        replies
    }

    fn begin(&mut self, modules: &[impl VirtualModule], from: usize, at: Nanos) {
        let Some(station) = self.stations.get_mut(from) else { return };
        let message = station.messages.pop_front();
        let port = modules.get(from).and_then(VirtualModule::rs485);
        let (Some(message), Some(module::Rs485 { baud, .. })) = (message, port) else { return };
        let each = BITS * SECOND / baud;
        station.sends = at + message.bytes.len() as u64 * each;
        self.put_all_on_wire(from, at, each, baud, &message);
    }

    fn arrive(&mut self, modules: &mut [impl VirtualModule], arrived: &ByteOnWire) {
        let ByteOnWire { at, from, baud, byte, .. } = *arrived;
        self.heard.push((at, from, byte));
        for (index, (station, module)) in self.stations.iter_mut().zip(modules).enumerate() {
            // A module with another bit rate receives nothing it could use.
            if index != from && module.rs485().is_some_and(|own| own.baud == baud) {
                station.host_spoke_last = false;
                station.hear(module, at, false, |module| module.overhear(byte));
            }
        }
    }
}

impl Station {
    /// When the module begins its next reply.
    fn starts(&self) -> Option<Nanos> {
        self.messages.front().map(|message| message.ready.max(self.heard + message.pause).max(self.sends))
    }

    fn hear<M: VirtualModule>(&mut self, module: &mut M, at: Nanos, announced: bool, bring: impl FnOnce(&mut M)) {
        if at < self.sends {
            return;
        }
        if !announced && at.saturating_sub(self.heard) > GAP {
            module.silence(Source::Rs485, Client::default());
        }
        self.heard = at;
        bring(module);
    }
}
