//! A fleet: one or more virtual modules that share virtual time, an RS485 bus and a CAN bus. `tmcl sim` runs a fleet.

mod agenda;
mod can;
mod control;
mod frames;
mod inquiries;
mod log;
mod replies;
mod requests;
mod rs485;
mod time;

use std::collections::VecDeque;
use std::convert::Infallible;

use hal_sim::clock::Nanos;
use hal_sim::fault::CanState;
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;

pub use can::{Heard, Node};

use crate::client::{Client, Sent};
use crate::module::VirtualModule;
use crate::native::{FirmwareKind, Model, NativeModule, Product};
use crate::wire::Transcript;
use log::{BUS, RS485, log_buses, usb};
use replies::{Fate, Leaving, Replies};

/// Frames that the CAN controller of a module takes before they are on the bus.
const MAILBOXES: usize = 3;

/// Modules and the buses between them.
pub struct Fleet<M = NativeModule> {
    modules: Vec<M>,
    now: Nanos,
    rs485: rs485::Rs485,
    can: can::Bus,
    /// Replies on USB links, each with the index of its module.
    sent: VecDeque<(usize, Sent)>,
    /// The links that have lost bytes since the last [`Fleet::take_lost`], and still do.
    lost: Lost,
    /// The USB cable of module 1 is out in a way that its hosts see.
    hung_up: bool,
    agenda: agenda::Agenda,
    requests: requests::Requests,
    inquiries: inquiries::Inquiries,
    /// The models of the modules.
    models: Vec<Model>,
    replies: Replies,
    /// The log of what goes over the links, if there is one.
    log: Option<Transcript>,
}

/// The links on which bytes of hosts were lost, because no module received them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lost {
    /// The USB link of module 1, because the module had no power or the cable was out.
    pub usb: bool,
    /// Both buses, because no module had power.
    pub buses: bool,
    /// The USB link of module 1 has lost its hosts, too: the cable was pulled out in a way that they see.
    pub hosts: bool,
}

/// A module of a fleet before it starts: what it is, where it stands, and what it has stored.
#[derive(Clone, Copy, Debug)]
pub struct Member<'a> {
    /// Product and firmware.
    pub model: Model,
    /// The world around the module, which is one of its own.
    pub world: &'a WorldConfig,
    /// The contents of the EEPROM, fresh if `None`.
    pub eeprom: Option<&'a [u8]>,
}

impl Fleet {
    /// Modules that run the core of the TMCL firmware of the TMCM-1140, each in its own world described by `config`: as
    /// many as there are EEPROMs. They are numbered, and get their seeds, as in [`Fleet::start`].
    pub fn new(config: &WorldConfig, eeproms: &[Option<&[u8]>], seed: u32) -> Self {
        Self::of(Model::default(), config, eeproms, seed)
    }

    /// The same with any product or firmware, which all modules have; `config` is to be a world for this product.
    pub fn of(model: impl Into<Model>, config: &WorldConfig, eeproms: &[Option<&[u8]>], seed: u32) -> Self {
        let model = model.into();
        let members: Vec<Member<'_>> =
            eeproms.iter().map(|eeprom| Member { model, world: config, eeprom: *eeprom }).collect();
        Self::mixed(&members, seed)
    }

    /// Modules that run the core of their firmware, each of a product of its own; the rest is as in [`Fleet::start`].
    pub fn mixed(members: &[Member<'_>], seed: u32) -> Self {
        let start = |Member { model, world, eeprom }: Member<'_>, seed| {
            Ok::<_, Infallible>(NativeModule::of(model, world, eeprom, seed))
        };
        let Ok(fleet) = Self::start(members, seed, start);
        fleet
    }
}

impl<M: VirtualModule> Fleet<M> {
    /// A module for each of the `members`, which are 255 at most and are numbered from 1. `start` makes a module of a
    /// member and a seed of random numbers. The number of a module with a fresh EEPROM is its address on the buses,
    /// where its model has one: `start` finds that in the EEPROM.
    ///
    /// # Errors
    /// The first error of `start`.
    pub fn start<E>(
        members: &[Member<'_>],
        seed: u32,
        mut start: impl FnMut(Member<'_>, u32) -> Result<M, E>,
    ) -> Result<Self, E> {
        let one = |(number, member): (u8, &Member<'_>)| {
            let numbered = if member.eeprom.is_none() { member.model.numbered_eeprom(number) } else { None };
            let eeprom = member.eeprom.or(numbered.as_deref());
            start(Member { eeprom, ..*member }, seed.wrapping_add(u32::from(number) - 1))
        };
        let modules = (1..=u8::MAX).zip(members).map(one).collect::<Result<Vec<M>, E>>()?;
        let (rs485, can) = (rs485::Rs485::new(modules.len()), can::Bus::default());
        // Modules may take different times to start; the fleet begins when the last has started.
        let now = modules.iter().map(M::now).max().unwrap_or_default();
        let (agenda, requests) = (agenda::Agenda::default(), requests::Requests::default());
        let models = members.iter().map(|member| member.model).collect();
        let (replies, sent, lost) = (Replies::of(modules.len()), VecDeque::new(), Lost::default());
        let mut fleet = Fleet {
            modules,
            now,
            rs485,
            can,
            sent,
            lost,
            agenda,
            requests,
            inquiries: inquiries::Inquiries::default(),
            models,
            replies,
            log: None,
            hung_up: false,
        };
        fleet.advance(now);
        fleet.exchange();
        Ok(fleet)
    }

    /// The modules.
    pub fn modules(&self) -> &[M] {
        &self.modules
    }

    /// The product of the module with this index.
    pub fn product(&self, index: usize) -> Option<Product> {
        self.models.get(index).map(|model| model.product())
    }

    /// The modules, to be changed. Power, USB cable and CAN controller are switched by [`Fleet::set_power`],
    /// [`Fleet::plug_usb`] and [`Fleet::set_can`], which also clear the links.
    pub fn modules_mut(&mut self) -> &mut [M] {
        &mut self.modules
    }

    /// Switches the supply of a module off or on. Replies that are not on the wire yet are lost when it is switched
    /// off.
    pub fn set_power(&mut self, index: usize, on: bool) {
        let Some(module) = self.modules.get_mut(index) else { return };
        module.set_power(on);
        if !on {
            self.replies.lose(index);
            self.rs485.cut_off(index);
            self.can.cut_off(Node::Module(index));
            self.lost.usb |= index == 0;
            self.requests.forget_parts();
            if !self.modules.iter_mut().any(|module| module.board_mut().is_powered()) {
                self.can.discard_all();
                self.lost.buses = true;
            }
        } else {
            self.lost.usb &= index != 0;
            self.lost.buses = false;
        }
    }

    /// Pulls the USB cable of a module out or plugs it in. Replies that are not on the wire yet are lost.
    pub fn plug_usb(&mut self, index: usize, on: bool) {
        let Some(module) = self.modules.get_mut(index) else { return };
        module.plug_usb(on);
        self.replies.cut_off(index, Source::Usb);
        self.requests.forget_parts();
        if index == 0 {
            self.hung_up &= !on;
            self.lost.usb = !on;
        }
    }

    /// Pulls the USB cable of a module out in a way that its hosts see: their connections end.
    pub fn hang_up_usb(&mut self, index: usize) {
        self.plug_usb(index, false);
        self.hung_up |= index == 0;
        self.lost.hosts |= index == 0;
    }

    /// True while the USB cable of module 1 is out in a way that its hosts see.
    pub fn is_hung_up(&self) -> bool {
        self.hung_up
    }

    /// Disturbs the CAN controller of a module, or lets it recover. Frames that have not been sent are lost when it
    /// goes off.
    pub fn set_can(&mut self, index: usize, state: CanState) {
        let Some(module) = self.modules.get_mut(index) else { return };
        module.set_can(state);
        if state == CanState::Off {
            self.replies.cut_off(index, Source::Can);
            self.can.cut_off(Node::Module(index));
        }
    }

    /// The links that have lost bytes of hosts since the last call, and on which a module still hears nothing. What
    /// hosts have sent there and nobody has taken is lost as well.
    pub fn take_lost(&mut self) -> Lost {
        std::mem::take(&mut self.lost)
    }

    /// Virtual time, in nanoseconds.
    pub fn now(&self) -> Nanos {
        self.now
    }

    /// When the next event of a module or bus is due, or the next command of the agenda.
    pub fn next_event(&self) -> Option<Nanos> {
        let modules = self.modules.iter().filter_map(M::next_event);
        let buses = self.rs485.next_event().into_iter().chain(self.can.next_event());
        modules.chain(buses).chain(self.replies.next_event()).chain(self.agenda.next()).min()
    }

    /// True while bytes or frames may reach a host although no host sends anything more.
    pub fn is_busy(&self) -> bool {
        let wires = self.rs485.next_event().is_some() || self.can.next_event().is_some();
        wires || self.replies.next_event().is_some() || self.modules.iter().any(M::is_busy)
    }

    /// Number of a client's bytes that module 1 has not read from its USB link.
    pub fn unread_usb(&self, client: Client) -> usize {
        self.modules.first().map_or(0, |module| module.unread(Source::Usb, client))
    }

    /// Number of bytes on the RS485 bus that are not dealt with, at the module with the largest number. These are the
    /// host's bytes that the module has not read, and bytes of replies that it has not begun to send.
    pub fn unread_rs485(&self) -> usize {
        let unread =
            |(index, module): (usize, &M)| module.unread(Source::Rs485, Client::default()) + self.rs485.waiting(index);
        self.modules.iter().enumerate().map(unread).max().unwrap_or_default()
    }

    /// Number of an adapter's frames that are not complete on the CAN bus.
    pub fn unsent_frames(&self, adapter: u64) -> usize {
        self.can.waiting(Node::Adapter(adapter))
    }

    /// Takes an adapter off the CAN bus; its frames are dropped.
    pub fn forget_adapter(&mut self, adapter: u64) {
        self.can.cut_off(Node::Adapter(adapter));
    }

    /// The next reply over a USB link, and the index of its module.
    pub fn sent(&mut self) -> Option<(usize, Sent)> {
        self.exchange();
        self.sent.pop_front()
    }

    /// Lets [`Fleet::silence_rs485`] alone end an unfinished telegram of the host on the RS485 bus, because the host
    /// does not live in virtual time. Else 5 ms of virtual time end the telegram.
    pub fn await_silences(&mut self) {
        self.rs485.silences_announced = true;
    }

    /// The bytes that the host has received on the RS485 bus since the last call.
    pub fn rs485(&mut self) -> Vec<u8> {
        self.rs485.heard.drain(..).map(|(_, _, byte)| byte).collect()
    }

    /// The next frame that was transmitted on the CAN bus.
    pub fn can(&mut self) -> Option<Heard> {
        self.can.heard.pop_front()
    }

    /// Logs from now on what goes over the links, as [`Transcript`] has it: what hosts send when it reaches the
    /// modules, and replies when hosts have them. Two fleets that hear the same at the same virtual times have the same
    /// log.
    pub fn log_telegrams(&mut self) {
        self.log = Some(Transcript::of(self.models.iter().copied()));
    }

    /// The lines of the log since the last call; empty without a log.
    pub fn take_telegrams(&mut self) -> String {
        self.log.as_mut().map(Transcript::take).unwrap_or_default()
    }

    /// Lets virtual time pass up to the next event, but not beyond `to`. What is due then is not dealt with yet.
    fn advance(&mut self, to: Nanos) {
        self.exchange();
        self.now = self.next_event().map_or(to, |at| at.clamp(self.now, to));
        for module in &mut self.modules {
            module.run_until(self.now);
        }
    }

    /// Takes the bytes that a module has sent.
    fn take_bytes(&mut self, index: usize) {
        while let Some(module) = self.modules.get_mut(index)
            && let Some(sent) = module.sent()
        {
            // Without a pause to be kept, the module's own UART sends byte by byte.
            let piecemeal = sent.source == Source::Rs485 && module.rs485().is_some_and(|port| port.pause.is_none());
            for fate in self.replies.take(index, sent, piecemeal) {
                match (fate, self.modules.get(index)) {
                    (Fate::Passes(sent), Some(module)) if sent.source == Source::Rs485 => {
                        self.rs485.reply(index, module, &sent);
                    }
                    (Fate::Passes(sent), _) => {
                        let (at, leaving) = (sent.at, Leaving::Bytes(sent));
                        if !self.replies.keep(self.now, at, index, &leaving) {
                            self.leave(at, index, leaving);
                        }
                    }
                    (Fate::Lost(sent), _) => {
                        if let Some(log) = &mut self.log {
                            let place = if sent.source == Source::Rs485 { RS485 } else { usb(sent.client) };
                            log.lose(sent.at, place, index, &sent.bytes);
                        }
                    }
                }
            }
        }
    }

    /// Takes the frames that a module has sent, as many as its controller has room for.
    fn take_frames(&mut self, index: usize) {
        let firmware = firmware(&self.models, index);
        while self.can.waiting(Node::Module(index)) < MAILBOXES
            && let Some(frame) = self.modules.get_mut(index).and_then(M::frame)
        {
            let leaving = Leaving::Frame(frame);
            match self.replies.take_frame(index, firmware, &frame, self.now) {
                Some(at) if self.replies.keep(self.now, at, index, &leaving) => {}
                Some(at) => self.leave(at, index, leaving),
                None => {
                    if let Some(log) = &mut self.log {
                        log.lose_frame(self.now, BUS, index, &frame);
                    }
                }
            }
        }
    }

    /// Lets a reply out of the module onto its link.
    fn leave(&mut self, at: Nanos, index: usize, leaving: Leaving) {
        match leaving {
            Leaving::Frame(frame) => self.can.send(Node::Module(index), frame),
            Leaving::Bytes(mut sent) => {
                sent.at = at;
                if let Some(log) = &mut self.log {
                    log.answer(at, usb(sent.client), index, &sent.bytes);
                }
                self.requests.reply(sent.replies);
                self.sent.extend(self.inquiries.take(sent).map(|sent| (index, sent)));
            }
        }
    }

    /// Delivers the bytes and frames that have arrived by now, and queues the replies of the modules.
    fn exchange(&mut self) {
        let (bytes, frames) = (self.rs485.heard.len(), self.can.heard.len());
        let replies = self.rs485.deliver(&mut self.modules, self.now);
        self.requests.reply(replies);
        self.can.deliver(&mut self.modules, self.now);
        self.requests.frames_heard(&self.models, self.can.heard.iter().skip(frames));
        if let Some(log) = &mut self.log {
            log_buses(log, self.rs485.heard.iter().skip(bytes), self.can.heard.iter().skip(frames));
        }
        while let Some((at, index, leaving)) = self.replies.arrived(self.now) {
            self.leave(at, index, leaving);
        }
        for index in 0..self.modules.len() {
            self.take_bytes(index);
            self.take_frames(index);
        }
        self.can.begin(&self.modules, self.now);
    }
}

/// The firmware in the module with this index.
fn firmware(models: &[Model], index: usize) -> FirmwareKind {
    models.get(index).copied().unwrap_or_default().firmware()
}
