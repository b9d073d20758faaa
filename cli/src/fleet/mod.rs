//! Several virtual modules that share one virtual time, an RS485 bus and a CAN bus.

mod can;
mod rs485;

use std::collections::VecDeque;
use std::convert::Infallible;

use hal_sim::clock::Nanos;
use hal_sim::world::config::WorldConfig;
use tmcm::can::Frame;
use tmcm::module::Source;
use tmcm::module::{TMCM_1140, Tmcm1140};
use tmcm::param::{GlobalParameter, Row};
use tmcm::store::{Need, Store};

pub use can::{Heard, Node};

use crate::client::{Client, Sent};
use crate::device::Device;
use crate::virtual_module::VirtualModule;

/// Bytes in an AT25128.
const EEPROM: usize = 16_384;

/// Modules and what connects them.
pub struct Fleet<M = VirtualModule> {
    modules: Vec<M>,
    now: Nanos,
    rs485: rs485::Rs485,
    can: can::Bus,
    /// Replies on point-to-point links, and the module each comes from.
    sent: VecDeque<(usize, Sent)>,
    /// Links have lost what was on its way since the last look.
    lost: Lost,
}

/// Which links have lost what hosts had sent, because nobody was there to hear it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lost {
    /// The USB link of module 1: it had no power, or the cable was out.
    pub usb: bool,
    /// The buses: no module had power.
    pub buses: bool,
}

impl Fleet {
    /// Modules that run the firmware's core, each in a world of its own described by `config`; the rest is as in
    /// [`Fleet::start`].
    pub fn new(config: &WorldConfig, eeproms: &[Option<&[u8]>], seed: u32) -> Self {
        let start = |eeprom: Option<&[u8]>, seed| Ok::<_, Infallible>(VirtualModule::new(config, eeprom, seed));
        let Ok(fleet) = Self::start(eeproms, seed, start);
        fleet
    }
}

impl<M: Device> Fleet<M> {
    /// As many modules as there are EEPROMs, numbered from 1, each started with its EEPROM and what makes everything
    /// random that is. A fresh EEPROM (`None`) is that of a module to which somebody has given its number as serial
    /// address and CAN identifier.
    ///
    /// # Errors
    /// A module cannot be started.
    pub fn start<E>(
        eeproms: &[Option<&[u8]>],
        seed: u32,
        mut start: impl FnMut(Option<&[u8]>, u32) -> Result<M, E>,
    ) -> Result<Self, E> {
        let one = |(number, eeprom): (i32, &Option<&[u8]>)| {
            let numbered = if eeprom.is_none() { numbered(number) } else { None };
            start(eeprom.or(numbered.as_deref()), seed.wrapping_add(number.cast_unsigned() - 1))
        };
        let modules = (1..).zip(eeproms).map(one).collect::<Result<Vec<M>, E>>()?;
        let (rs485, can) = (rs485::Rs485::new(modules.len()), can::Bus::default());
        // All have started.
        let now = modules.iter().map(M::now).max().unwrap_or_default();
        Ok(Fleet { modules, now, rs485, can, sent: VecDeque::new(), lost: Lost::default() })
    }

    /// The modules.
    pub fn modules(&self) -> &[M] {
        &self.modules
    }

    /// The modules, to do something to one of them; but for its power see [`Fleet::set_power`], for its USB cable
    /// [`Fleet::plug_usb`].
    pub fn modules_mut(&mut self) -> &mut [M] {
        &mut self.modules
    }

    /// Switches the supply of a module off or on. What it was going to send is lost.
    pub fn set_power(&mut self, index: usize, on: bool) {
        let Some(module) = self.modules.get_mut(index) else { return };
        module.set_power(on);
        if !on {
            self.rs485.cut_off(index);
            self.can.cut_off(Node::Module(index));
            self.sent.retain(|(from, _)| *from != index);
            self.lost.usb |= index == 0;
            if !self.modules.iter_mut().any(|module| module.board_mut().is_powered()) {
                self.can.fall_silent();
                self.lost.buses = true;
            }
        }
    }

    /// Pulls the USB cable of a module out or plugs it in. What is on its way is lost.
    pub fn plug_usb(&mut self, index: usize, on: bool) {
        let Some(module) = self.modules.get_mut(index) else { return };
        module.plug_usb(on);
        self.sent.retain(|(from, _)| *from != index);
        self.lost.usb |= index == 0 && !on;
    }

    /// Which links have lost since the last call what hosts had sent before.
    pub fn take_lost(&mut self) -> Lost {
        std::mem::take(&mut self.lost)
    }

    /// Virtual time.
    pub fn now(&self) -> Nanos {
        self.now
    }

    /// Lets time pass until `to`.
    pub fn run_until(&mut self, to: Nanos) {
        let to = to.max(self.now);
        loop {
            self.exchange();
            self.now = self.next_event().map_or(to, |at| at.clamp(self.now, to));
            for module in &mut self.modules {
                module.run_until(self.now);
            }
            if self.now == to {
                return self.exchange();
            }
        }
    }

    /// Lets `span` pass.
    pub fn run(&mut self, span: Nanos) {
        self.run_until(self.now + span);
    }

    /// When something happens next.
    pub fn next_event(&self) -> Option<Nanos> {
        let modules = self.modules.iter().filter_map(M::next_event);
        modules.chain(self.rs485.next_event()).chain(self.can.next_event()).min()
    }

    /// True while somebody may hear something without doing anything for it.
    pub fn is_busy(&self) -> bool {
        let wires = self.rs485.next_event().is_some() || self.can.next_event().is_some();
        wires || self.modules.iter().any(M::is_busy)
    }

    /// How many bytes of a client on the USB link of module 1 it has not come to.
    pub fn unread_usb(&self, client: Client) -> usize {
        self.modules.first().map_or(0, |module| module.unread(Source::Usb, client))
    }

    /// How many bytes of the host on the RS485 bus the modules have not come to, and of replies to them that have not been
    /// on the bus, at the module with most of them.
    pub fn unread_rs485(&self) -> usize {
        let unread =
            |(index, module): (usize, &M)| module.unread(Source::Rs485, Client::default()) + self.rs485.waiting(index);
        self.modules.iter().enumerate().map(unread).max().unwrap_or_default()
    }

    /// How many frames of an adapter have not been on the CAN bus.
    pub fn unsent_frames(&self, adapter: u64) -> usize {
        self.can.waiting(Node::Adapter(adapter))
    }

    /// An adapter is not on the CAN bus any more.
    pub fn forget_adapter(&mut self, adapter: u64) {
        self.can.cut_off(Node::Adapter(adapter));
    }

    /// A reply over a point-to-point link, and the index of the module that it comes from.
    pub fn sent(&mut self) -> Option<(usize, Sent)> {
        self.exchange();
        self.sent.pop_front()
    }

    /// The host sends bytes on the RS485 bus.
    pub fn send_rs485(&mut self, bytes: &[u8]) {
        self.rs485.send(&mut self.modules, self.now, bytes);
    }

    /// From now on the host's silences on the RS485 bus are those it is told of by [`Fleet::silence_rs485`]: the host
    /// lives in another time than the modules. Else a silence is one of virtual time.
    pub fn await_silences(&mut self) {
        self.rs485.told = true;
    }

    /// The host has been silent on the RS485 bus.
    pub fn silence_rs485(&mut self) {
        self.rs485.silence(&mut self.modules);
    }

    /// What the host has heard on the RS485 bus since the last call.
    pub fn rs485(&mut self) -> Vec<u8> {
        self.rs485.host.drain(..).collect()
    }

    /// An adapter sends a frame on the CAN bus.
    pub fn send_can(&mut self, adapter: u64, frame: Frame) {
        self.can.send(Node::Adapter(adapter), frame);
        self.can.begin(&self.modules, self.now);
    }

    /// A frame that was on the CAN bus.
    pub fn can(&mut self) -> Option<Heard> {
        self.can.heard.pop_front()
    }

    /// Brings everybody what has arrived by now, and what that leads to on its way.
    fn exchange(&mut self) {
        self.rs485.deliver(&mut self.modules, self.now);
        self.can.deliver(&mut self.modules, self.now);
        for (index, module) in self.modules.iter_mut().enumerate() {
            while let Some(sent) = module.sent() {
                if sent.source == Source::Rs485 {
                    self.rs485.reply(index, module, sent.at, &sent.bytes);
                } else {
                    self.sent.push_back((index, sent));
                }
            }
            while let Some(frame) = module.frame() {
                self.can.send(Node::Module(index), frame);
            }
        }
        self.can.begin(&self.modules, self.now);
    }
}

/// The EEPROM of a module with an address of its own; `None` where that is the factory default.
fn numbered(number: i32) -> Option<Vec<u8>> {
    let parameters = [GlobalParameter::SerialAddress, GlobalParameter::CanId];
    let rows = parameters.map(|parameter| TMCM_1140.global.row(parameter));
    let rows = rows.into_iter().flatten().filter(|row| row.default != number);
    let slots: Vec<u8> = rows.filter_map(Row::slot).collect();
    let mut store = Store::<Tmcm1140>::new();
    store.forget();
    for slot in &slots {
        store.set((*slot).into(), number).then_some(())?;
    }
    let mut contents = vec![0xFF; EEPROM];
    while !store.settled(Need::Settings) {
        let job = store.next_job()?;
        let address = usize::from(job.address);
        contents.get_mut(address..)?.get_mut(..job.page.len())?.copy_from_slice(&job.page);
        store.finish(true);
    }
    (!slots.is_empty()).then_some(contents)
}
