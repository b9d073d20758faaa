//! Time that passes on behalf of hosts: as far as their outstanding requests need for the replies, and no further.
//!
//! While time is paused, nothing else lets it pass unasked. A request on USB takes the millisecond of its frame, one on a
//! bus the time of its bits. While an EEPROM works, a request is waited for without limit, else for [`PATIENCE`] at most:
//! then it is given up, and costs no time any more. A telegram that has come in part, an event and a frame that nobody
//! answers cost no time.

use hal_sim::clock::{Nanos, SECOND};
use tmcm::can::Frame;
use tmcm::module::Source;

use super::frames::{Wish, answers, wish};
use super::log::{RS485, usb};
use super::{Fleet, Heard, Node};
use crate::client::Client;
use crate::module::VirtualModule;
use crate::pieces::Pieces;
use crate::wire::answering::is_silent_telegram;

/// Longest time that passes on behalf of a request since it came, or since an EEPROM last worked.
const PATIENCE: Nanos = SECOND;

/// A host on a byte link.
#[derive(Debug)]
struct Host {
    source: Source,
    client: Client,
    /// What it has sent of a telegram that is not whole.
    pieces: Pieces,
}

/// Something that a host has sent and that may be answered.
#[derive(Debug)]
struct Waiting {
    what: What,
    /// When it came, or when an EEPROM last worked.
    since: Nanos,
}

#[derive(Debug)]
enum What {
    /// Bytes on a byte link, of a client.
    Bytes(Source, Client),
    /// A frame.
    Frame(Frame),
}

/// What hosts wait for, and how many replies there have been.
#[derive(Debug, Default)]
pub(super) struct Requests {
    hosts: Vec<Host>,
    waiting: Vec<Waiting>,
    answered: u64,
}

impl Requests {
    /// Bytes of a host have come.
    fn hear(&mut self, source: Source, client: Client, now: Nanos, bytes: &[u8]) {
        let whole = self.host(source, client).pieces.push(bytes);
        self.answered +=
            whole.iter().filter(|whole| whole.as_slice().try_into().is_ok_and(is_silent_telegram)).count() as u64;
        let is_theirs =
            |waiting: &&mut Waiting| matches!(waiting.what, What::Bytes(s, c) if (s, c) == (source, client));
        match self.waiting.iter_mut().find(is_theirs) {
            Some(waiting) => waiting.since = now,
            None => self.waiting.push(Waiting { what: What::Bytes(source, client), since: now }),
        }
    }

    /// A host has been silent for so long that an unfinished telegram is given up.
    fn silence(&mut self, source: Source, client: Client) {
        self.host(source, client).pieces.silence();
    }

    fn host(&mut self, source: Source, client: Client) -> &mut Host {
        let index = self.hosts.iter().position(|host| (host.source, host.client) == (source, client));
        let index = index.unwrap_or_else(|| {
            self.hosts.push(Host { source, client, pieces: Pieces::default() });
            self.hosts.len() - 1
        });
        &mut self.hosts[index]
    }

    /// What hosts have sent of telegrams that are not whole has been lost.
    pub(super) fn forget_parts(&mut self) {
        self.hosts.clear();
    }

    /// Replies have come to hosts on byte links.
    pub(super) fn reply(&mut self, count: u64) {
        self.answered += count;
    }
}

impl<M: VirtualModule> Fleet<M> {
    /// Bytes of a client on the USB link of module 1 arrive.
    pub fn hear_usb(&mut self, client: Client, bytes: &[u8]) {
        let Some(module) = self.modules.first_mut() else { return };
        if let Some(log) = &mut self.log {
            log.hear(self.now, usb(client), bytes);
        }
        module.hear(Source::Usb, client, bytes);
        self.requests.hear(Source::Usb, client, self.now, bytes);
    }

    /// Ends an unfinished telegram of a client on the USB link of module 1: the client has been silent for too long.
    pub fn silence_usb(&mut self, client: Client) {
        if let Some(log) = &mut self.log {
            log.silence(self.now, usb(client));
        }
        if let Some(module) = self.modules.first_mut() {
            module.silence(Source::Usb, client);
            self.requests.silence(Source::Usb, client);
        }
    }

    /// True while anything for a client on the USB link of module 1 may be on its way.
    pub fn owes_usb(&self, client: Client) -> bool {
        let module = self.modules.first();
        module.is_some_and(|module| module.owes(Source::Usb, client)) || self.replies.owes(Source::Usb, client)
    }

    /// Clients whose sessions the USB link of module 1 has ended in favour of others since the last call.
    pub fn take_ended(&mut self) -> Vec<Client> {
        self.modules.first_mut().map(M::take_ended).unwrap_or_default()
    }

    /// Forgets a client of the USB link of module 1 that has gone. What it has sent is carried out all the same.
    pub fn forget_usb(&mut self, client: Client) {
        if let Some(log) = &mut self.log {
            log.forget(self.now, usb(client));
        }
        self.requests.hosts.retain(|host| (host.source, host.client) != (Source::Usb, client));
        if let Some(module) = self.modules.first_mut() {
            module.forget(client);
        }
    }

    /// Sends bytes of the host on the RS485 bus.
    pub fn send_rs485(&mut self, bytes: &[u8]) {
        if let Some(log) = &mut self.log {
            log.hear(self.now, RS485, bytes);
        }
        self.rs485.send(&mut self.modules, self.now, bytes);
        self.requests.hear(Source::Rs485, Client::default(), self.now, bytes);
    }

    /// The host has been silent on the RS485 bus for longer than a telegram may pause.
    pub fn silence_rs485(&mut self) {
        if let Some(log) = &mut self.log {
            log.silence(self.now, RS485);
        }
        self.rs485.silence(&mut self.modules);
        self.requests.silence(Source::Rs485, Client::default());
    }

    /// Sends a frame of an adapter on the CAN bus.
    pub fn send_can(&mut self, adapter: u64, frame: Frame) {
        let wishes = self.models.iter().map(|model| wish(model.firmware(), &frame));
        match wishes.max().unwrap_or(Wish::Nothing) {
            Wish::Reply => self.requests.waiting.push(Waiting { what: What::Frame(frame), since: self.now }),
            Wish::Silence => self.requests.answered += 1,
            Wish::Nothing => {}
        }
        self.can.send(Node::Adapter(adapter), frame);
        self.can.begin(&self.modules, self.now);
    }

    /// Lets time pass up to the next event, but not beyond `latest`, on behalf of hosts that wait for replies. False if no
    /// time has passed: nobody waits, or it is `latest` already. How far time gets in the end does not depend on how often
    /// this is called, or on `latest`.
    pub fn serve(&mut self, latest: Nanos) -> bool {
        self.exchange();
        self.settle();
        let ends = self.requests.waiting.iter().map(|waiting| waiting.since + PATIENCE).min();
        let Some(ends) = ends.filter(|_| self.now < latest) else { return false };
        let next = self.next_event().unwrap_or(ends).clamp(self.now + 1, ends);
        self.run_until(next.min(latest));
        true
    }

    /// Number of requests of hosts that have been answered so far. Those that are carried out in silence, 137 among them,
    /// count when they come; events, and frames that nobody has asked for, do not count.
    pub fn answered(&self) -> u64 {
        self.requests.answered
    }

    /// Frames are complete on the CAN bus, from place `first` on: those of modules may be replies to requests.
    pub(super) fn frames_heard(&mut self, first: usize) {
        for heard in self.can.heard.iter().skip(first) {
            let Heard { from: Node::Module(module), frame, .. } = heard else { continue };
            let firmware = self.firmware(*module);
            let is_asked =
                |Waiting { what, .. }: &Waiting| matches!(what, What::Frame(asked) if answers(firmware, asked, frame));
            if let Some(index) = self.requests.waiting.iter().position(is_asked) {
                self.requests.waiting.remove(index);
                self.requests.answered += 1;
            }
        }
    }

    /// Looks who still waits for something that may come. Who has waited for too long is forgotten, but not while an EEPROM
    /// works.
    fn settle(&mut self) {
        if self.requests.waiting.is_empty() {
            return;
        }
        let (modules, late, host) = (&self.modules, &self.replies, Client::default());
        let rs485 = self.rs485.has_reply() || modules.iter().any(|module| module.awaits(Source::Rs485, host));
        let can = self.can.is_in_use() || modules.iter().any(|module| module.awaits(Source::Can, host));
        let can = can || late.owes(Source::Can, host);
        let usb = |client| {
            let module = modules.first();
            module.is_some_and(|module| module.awaits(Source::Usb, client)) || late.owes(Source::Usb, client)
        };
        self.requests.waiting.retain(|waiting| match waiting.what {
            What::Bytes(Source::Usb, client) => usb(client),
            What::Bytes(Source::Rs485, _) => rs485,
            What::Bytes(Source::Can, _) | What::Frame(_) => can,
        });
        let works = |module: &mut M| module.board_mut().at25().next_event();
        let worked = self.modules.iter_mut().filter_map(works).max().unwrap_or_default();
        self.requests.waiting.iter_mut().for_each(|waiting| waiting.since = waiting.since.max(worked));
        self.requests.waiting.retain(|waiting| self.now < waiting.since + PATIENCE);
    }
}
