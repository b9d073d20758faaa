//! Time that passes on behalf of hosts: as far as their outstanding requests need for the replies, and no further.
//!
//! While time is paused, nothing else lets it pass unasked. A request on USB takes the millisecond of its frame, one on
//! a bus the time of its bits. While an EEPROM works, a request is waited for without limit, else for [`PATIENCE`] at
//! most: then it is given up, and costs no time any more. A telegram that has come in part, an event and a frame that
//! nobody answers cost no time.

use hal_sim::clock::{Nanos, SECOND};
use tmcm::can::Frame;
use tmcm::module::Source;

use super::frames::{Wish, answers, wish};
use super::log::{RS485, usb};
use super::{Fleet, Heard, Node, firmware};
use crate::client::Client;
use crate::module::{Hearing, VirtualModule};
use crate::native::Model;
use crate::pieces::Pieces;
use crate::wire::answering::is_silent_telegram;

/// Longest time that passes on behalf of a request since it came, or since an EEPROM last worked.
const PATIENCE: Nanos = SECOND;

/// A host on a byte link.
#[derive(Debug)]
struct Host {
    /// Where its bytes come.
    link: What,
    /// The bytes that it has sent of a telegram that is not whole.
    pieces: Pieces,
}

/// Something that a host has sent and that may be answered.
#[derive(Debug)]
struct Waiting {
    what: What,
    /// When it came, or when an EEPROM last worked.
    since: Nanos,
    /// No module heard it: it is lost, and its host asks again.
    unheard: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    /// Bytes of a client on the USB link of the module with this index.
    Usb(usize, Client),
    /// Bytes on the RS485 bus.
    Rs485,
    /// A frame.
    Frame(Frame),
}

/// The requests that hosts wait for, and how many replies there have been.
#[derive(Debug, Default)]
pub(super) struct Requests {
    hosts: Vec<Host>,
    waiting: Vec<Waiting>,
    answered: u64,
}

impl Requests {
    /// Bytes of a host have come.
    fn hear(&mut self, what: What, now: Nanos, unheard: bool, bytes: &[u8]) {
        let whole = self.host(&what).pieces.push(bytes);
        self.answered +=
            whole.iter().filter(|whole| whole.as_slice().try_into().is_ok_and(is_silent_telegram)).count() as u64;
        match self.waiting.iter_mut().find(|waiting| waiting.what == what) {
            Some(waiting) => (waiting.since, waiting.unheard) = (now, unheard),
            None => self.waiting.push(Waiting { what, since: now, unheard }),
        }
    }

    /// A host has been silent for so long that an unfinished telegram is given up.
    fn silence(&mut self, what: &What) {
        self.host(what).pieces.silence();
    }

    fn host(&mut self, link: &What) -> &mut Host {
        let index = self.hosts.iter().position(|host| host.link == *link);
        let index = index.unwrap_or_else(|| {
            self.hosts.push(Host { link: *link, pieces: Pieces::default() });
            self.hosts.len() - 1
        });
        &mut self.hosts[index]
    }

    /// A host on a byte link has gone.
    fn forget(&mut self, link: &What) {
        self.hosts.retain(|host| host.link != *link);
    }

    /// Forgets the bytes that hosts have sent of telegrams that are not whole, because they have been lost.
    pub(super) fn forget_parts(&mut self) {
        self.hosts.clear();
    }

    /// Replies have come to hosts on byte links.
    pub(super) fn reply(&mut self, count: u64) {
        self.answered += count;
    }

    /// Frames are complete on the CAN bus: those of modules may be replies to requests.
    pub(super) fn frames_heard<'a>(&mut self, models: &[Model], frames: impl Iterator<Item = &'a Heard>) {
        for heard in frames {
            let Heard { from: Node::Module(module), frame, .. } = heard else { continue };
            let firmware = firmware(models, *module);
            let is_asked =
                |Waiting { what, .. }: &Waiting| matches!(what, What::Frame(asked) if answers(firmware, asked, frame));
            if let Some(index) = self.waiting.iter().position(is_asked) {
                self.waiting.remove(index);
                self.answered += 1;
            }
        }
    }
}

impl<M: VirtualModule> Fleet<M> {
    /// Bytes of a client on the USB link of module 1 arrive.
    pub fn hear_usb(&mut self, client: Client, bytes: &[u8]) {
        self.hear_usb_of(0, client, bytes);
    }

    pub(super) fn hear_usb_of(&mut self, index: usize, client: Client, bytes: &[u8]) {
        let Some(module) = self.modules.get_mut(index) else { return };
        if let Some(log) = &mut self.log {
            log.hear(self.now, usb(client), bytes);
        }
        let unheard = module.hearing(Source::Usb) != Hearing::Now;
        module.hear(Source::Usb, client, bytes);
        self.requests.hear(What::Usb(index, client), self.now, unheard, bytes);
    }

    /// Ends an unfinished telegram of a client on the USB link of module 1: the client has been silent for too long.
    pub fn silence_usb(&mut self, client: Client) {
        if let Some(log) = &mut self.log {
            log.silence(self.now, usb(client));
        }
        if let Some(module) = self.modules.first_mut() {
            module.silence(Source::Usb, client);
            self.requests.silence(&What::Usb(0, client));
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
        self.forget_usb_of(0, client);
    }

    pub(super) fn forget_usb_of(&mut self, index: usize, client: Client) {
        if let Some(log) = &mut self.log {
            log.forget(self.now, usb(client));
        }
        self.requests.forget(&What::Usb(index, client));
        if let Some(module) = self.modules.get_mut(index) {
            module.forget(client);
        }
    }

    /// True while a client on the USB link of the module with this index waits for a reply that may come.
    pub(super) fn awaits_usb_of(&mut self, index: usize, client: Client) -> bool {
        self.settle();
        self.requests.waiting.iter().any(|waiting| waiting.what == What::Usb(index, client))
    }

    /// Sends bytes of the host on the RS485 bus.
    pub fn send_rs485(&mut self, bytes: &[u8]) {
        if let Some(log) = &mut self.log {
            log.hear(self.now, RS485, bytes);
        }
        let unheard = !self.modules.iter().any(|module| module.hearing(Source::Rs485) == Hearing::Now);
        self.rs485.send(&mut self.modules, self.now, bytes);
        self.requests.hear(What::Rs485, self.now, unheard, bytes);
    }

    /// The host has been silent on the RS485 bus for longer than a telegram may pause.
    pub fn silence_rs485(&mut self) {
        if let Some(log) = &mut self.log {
            log.silence(self.now, RS485);
        }
        self.rs485.silence(&mut self.modules);
        self.requests.silence(&What::Rs485);
    }

    /// Sends a frame of an adapter on the CAN bus.
    pub fn send_can(&mut self, adapter: u64, frame: Frame) {
        let wishes = self.models.iter().map(|model| wish(model.firmware(), &frame));
        match wishes.max().unwrap_or(Wish::Nothing) {
            Wish::Reply => {
                let unheard = self.modules.iter().any(|module| module.hearing(Source::Can) != Hearing::Now);
                self.requests.waiting.push(Waiting { what: What::Frame(frame), since: self.now, unheard });
            }
            Wish::Silence => self.requests.answered += 1,
            Wish::Nothing => {}
        }
        self.can.send(Node::Adapter(adapter), frame);
        self.can.begin(&self.modules, self.now);
    }

    /// Lets time pass up to the next event, but not beyond `latest`, on behalf of hosts that wait for replies. False if
    /// no time has passed: nobody waits, or it is `latest` already. How far time gets in the end does not depend on how
    /// often this is called, or on `latest`.
    pub fn serve(&mut self, latest: Nanos) -> bool {
        self.exchange();
        self.settle();
        let ends = self.requests.waiting.iter().map(|waiting| waiting.since + PATIENCE).min();
        let Some(ends) = ends.filter(|_| self.now < latest) else { return false };
        let next = self.next_event().unwrap_or(ends).clamp(self.now + 1, ends);
        self.run_until(next.min(latest));
        true
    }

    /// Number of requests of hosts that have been answered so far. Those that are carried out in silence, 137 among
    /// them, count when they come; events, and frames that nobody has asked for, do not count.
    pub fn answered(&self) -> u64 {
        self.requests.answered
    }

    /// Looks who still waits for something that may come. Who has waited for too long is forgotten, but not while an
    /// EEPROM works.
    fn settle(&mut self) {
        if self.requests.waiting.is_empty() {
            return;
        }
        let (modules, late, host) = (&self.modules, &self.replies, Client::default());
        let rs485 = self.rs485.has_reply() || modules.iter().any(|module| module.awaits(Source::Rs485, host));
        let can = self.can.is_in_use() || modules.iter().any(|module| module.awaits(Source::Can, host));
        let can = can || late.owes(Source::Can, host);
        let usb = |index, client| {
            let module: Option<&M> = modules.get(index);
            module.is_some_and(|module| module.awaits(Source::Usb, client)) || late.owes(Source::Usb, client)
        };
        // What nobody heard takes the time until somebody does, if that will be.
        let changes = self.agenda.next().is_some();
        let will_hear = |module: &M, source| match module.hearing(source) {
            Hearing::Now => false,
            Hearing::Soon => true,
            Hearing::Off => changes,
        };
        let will_any = |source| modules.iter().any(|module| will_hear(module, source));
        self.requests.waiting.retain(|waiting| match waiting.what {
            What::Usb(index, client) => {
                let lost =
                    || waiting.unheard && modules.get(index).is_some_and(|module| will_hear(module, Source::Usb));
                usb(index, client) || lost()
            }
            What::Rs485 => rs485 || waiting.unheard && will_any(Source::Rs485),
            What::Frame(_) => can || waiting.unheard && will_any(Source::Can),
        });
        let works = |module: &mut M| module.board_mut().at25().next_event();
        let worked = self.modules.iter_mut().filter_map(works).max().unwrap_or_default();
        self.requests.waiting.iter_mut().for_each(|waiting| waiting.since = waiting.since.max(worked));
        self.requests.waiting.retain(|waiting| self.now < waiting.since + PATIENCE);
    }
}
