//! The CANopen firmware as a [`Firmware`].

use super::{Firmware, OnBoard, Surroundings};
use crate::can::StandardId;
use crate::canopen::{Address, Bus, Node, usb};
use crate::device::{Circuit, Inputs, Outputs, Parts};
use crate::executor::Product;
use crate::module::{LinkEnds, LinkMode, LinkSettings, Request, Source};
use crate::store::{Job, Store};
use crate::tmcl::ascii::Echo;
use crate::units::Micros;

/// The settings of the USB link. Those of CAN are the node's own, and those of RS485 nobody's.
static USB: LinkSettings = LinkSettings {
    address: usb::MODULE_ADDRESS,
    host: usb::HOST_ADDRESS,
    secondary: 0,
    pause: 0,
    echo: Echo::None,
    start: LinkMode::Binary,
    can_id: StandardId::ZERO,
    can_secondary: None,
    can_reply: StandardId::ZERO,
};

impl<T: Circuit<Product: Product>> Firmware for Node<T> {
    type Inputs = Inputs<1>;

    /// A frame first: a telegram over USB is no hurry.
    #[inline(always)]
    fn serve(&mut self, around: &mut impl Surroundings) -> bool {
        let now = around.now();
        if let Some(bus) = around.bus()
            && let Some(frame) = bus.read()
        {
            self.receive(now, &frame);
            self.send(bus);
            return true;
        }
        serve_usb(self, around)
    }

    #[inline(always)]
    fn deadline(&self) -> Micros {
        self.deadline()
    }

    #[inline(always)]
    fn takes_inputs(&self, now: Micros) -> bool {
        self.takes_inputs(now)
    }

    #[inline(always)]
    fn poll(&mut self, now: Micros, inputs: &Inputs<1>) -> Option<Outputs> {
        Some(self.poll(now, inputs))
    }

    fn deliver(&mut self, around: &mut impl Surroundings) {
        let now = around.now();
        if let Some(bus) = around.bus() {
            self.look_at(now, bus);
            self.send(bus);
        }
    }

    fn refill(&mut self, around: &mut impl Surroundings) {
        if let Some(bus) = around.bus() {
            self.send(bus);
        }
    }

    #[inline(always)]
    fn next_job(&mut self) -> Option<Job> {
        self.store().next_job()
    }

    #[inline(always)]
    fn stored(&mut self, written: bool) {
        self.stored(written);
    }

    fn usb_name(&self) -> &'static str {
        T::Product::SPEC.usb
    }

    #[inline(always)]
    fn link_settings(&self) -> &LinkSettings {
        &USB
    }

    fn baud_rate(&self) -> Option<u32> {
        None
    }

    fn can_bit_rate(&self) -> Option<u32> {
        self.address().map(Address::bits_per_second)
    }

    /// The address, for a restart after which the EEPROM does not tell it.
    fn kept(&self) -> Option<[u32; 2]> {
        self.address().map(Address::to_kept)
    }

    /// On CAN the reply to a request to save waits until all is saved.
    fn awaits(&self, source: Source) -> bool {
        source == Source::Can && !self.is_settled()
    }

    fn is_restarting(&self) -> bool {
        self.is_restarting()
    }
}

/// Serves a telegram that has come over USB.
#[inline(never)]
fn serve_usb<T: Circuit<Product: Product>>(node: &mut Node<T>, around: &mut impl LinkEnds) -> bool {
    let Some(request) = around.request(Source::Usb, &USB) else { return false };
    let now = around.now();
    let reply = if let Request::Telegram(telegram) = &request { Some(node.serve_usb(now, telegram)) } else { None };
    around.answer(Source::Usb.into(), reply.as_ref(), Some(LinkMode::Binary), &USB);
    true
}

impl<T: Circuit<Product: Product>> OnBoard<1> for Node<T> {
    type Circuit = T;

    #[inline(always)]
    fn new(parts: Parts<T, 1>, _: u32) -> Self {
        Node::new(parts)
    }

    fn remember(&mut self, kept: [u32; 2]) {
        self.remember(Address::from_kept(kept));
    }

    fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<T::Product>)) {
        self.start(now, load);
    }

    /// Node ID and bit rate included.
    fn factory_reset(store: &mut Store<T::Product>) {
        store.reset(false);
    }
}
