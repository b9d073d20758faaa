//! The CANopen firmware as the owner serves it.

use core::ops::ControlFlow;

use super::ends::Ends;
use super::firmware::Firmware;
use crate::board::stm32f4::can;
use crate::board::stm32f4::can_node::NodeLink;
use crate::board::stm32f4::clocks::now;
use crate::board::stm32f4::kept::Kept;
use crate::can::{CanFrame, Frame, StandardId};
use crate::canopen::{Address, BusState, Node, Overflow, usb};
use crate::device::{Board, Inputs, Outputs, Parts};
use crate::executor::Product;
use crate::module::{LinkEnds, LinkMode, LinkSettings, Request, Source};
use crate::store::{Job, Store};
use crate::units::Micros;

/// The identifier of error control, without the node ID.
const ERROR_CONTROL: u16 = 0x700;

/// The address of the node, for a restart after which the EEPROM does not tell it.
#[unsafe(link_section = ".uninit.address")]
static ADDRESS: Kept<[u32; 2]> = Kept::new();

/// A node of CANopen.
#[repr(C)]
pub struct Canopen<T: Board<Product: Product> + 'static> {
    node: Node<T>,
    link: NodeLink,
    /// The boot-up message is on its way; nothing else is sent before it, whatever its identifier.
    boots: bool,
    /// The state of the bus as the node knows it.
    bus: BusState,
    /// The address was unknown when it was asked for.
    unknown: bool,
    /// What TMCL has as the settings of the USB link.
    settings: LinkSettings,
}

impl<T: Board<Product: Product> + 'static> Canopen<T> {
    /// Serves a telegram that has come over USB.
    #[inline(never)]
    fn serve_usb(&mut self, ends: &mut Ends) -> bool {
        let Some(request) = ends.request(Source::Usb, &self.settings) else { return false };
        let reply =
            if let Request::Telegram(telegram) = &request { Some(self.node.serve_usb(now(), telegram)) } else { None };
        ends.answer(Source::Usb.into(), reply.as_ref(), Some(LinkMode::Binary), &self.settings);
        true
    }

    /// Sends what the node has to send, and sees to the filters before, because what a reply confirms is to hold. Off the
    /// bus the node keeps its frames.
    fn send(&mut self, ends: &Ends) {
        if ends.can.is_none() {
            return;
        }
        if let Some(filters) = self.node.filters() {
            self.link.listen_to(&filters);
        }
        self.link.settle();
        if self.bus != BusState::Off {
            while let ControlFlow::Continue(()) = self.send_next() {}
        }
        self.link.enable_interrupts(self.boots || self.link.waits());
    }

    fn send_next(&mut self) -> ControlFlow<()> {
        self.boots = self.boots && !self.link.is_empty();
        if self.boots || !self.link.has_room() {
            return ControlFlow::Break(());
        }
        let Some(frame) = self.node.next_frame() else { return ControlFlow::Break(()) };
        self.boots = self.is_boot_up(&frame);
        self.link.write(&frame);
        ControlFlow::Continue(())
    }

    /// True for the message by which a node tells that it has started: error control, with a state of 0.
    fn is_boot_up(&self, frame: &Frame) -> bool {
        let id = StandardId::new(ERROR_CONTROL | u16::from(self.node.node_id()));
        id.is_some_and(|id| frame.id() == id.into()) && frame.data() == [0]
    }

    /// Notes an address that is known, and keeps it for the case that the EEPROM is silent after a restart.
    fn know(&mut self) -> Option<Address> {
        let address = self.node.address()?;
        self.unknown = false;
        // SAFETY: the owner of the firmware alone, and the start before it, use this.
        unsafe { ADDRESS.write(address.to_kept()) };
        defmt::info!("CANopen node {=u8} at {=u16} kbit/s", address.node, address.bit_rate);
        Some(address)
    }

    /// Tells the node what has become of the bus since the last millisecond.
    fn look_at_bus(&mut self, now: Micros) {
        if self.link.has_overrun() {
            self.node.lost(now, Overflow::Controller);
        }
        let state = self.link.state();
        if state == BusState::Off && self.bus != BusState::Off {
            defmt::debug!("CAN: bus-off");
            // But for the boot-up message, all that waits is out of date when the others hear this node again.
            if !self.boots {
                self.link.clear();
            }
        }
        self.bus = state;
        self.node.bus(now, state);
    }
}

/// In bit/s.
fn bit_rate(address: Address) -> u32 {
    u32::from(address.bit_rate) * 1000
}

impl<T: Board<Product: Product> + 'static> Firmware<1> for Canopen<T> {
    type Board = T;

    const CAN_IN_ORDER: bool = false;

    #[inline(always)]
    fn new(parts: Parts<T, 1>, _: u32) -> Self {
        let settings =
            LinkSettings { address: usb::MODULE_ADDRESS, host: usb::HOST_ADDRESS, ..LinkSettings::default() };
        let (node, link) = (Node::new(parts), NodeLink::new());
        Canopen { node, link, boots: false, bus: BusState::Active, unknown: true, settings }
    }

    fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<T::Product>)) {
        // SAFETY: as in `know`; and any bits are two words.
        self.node.remember(Address::from_kept(unsafe { ADDRESS.read() }));
        self.node.start(now, load);
        if self.node.address().is_none() {
            defmt::error!("CANopen: the node ID is unknown; 137 over USB starts node 1 with defaults");
        }
        self.know();
    }

    /// Node ID and bit rate included.
    fn factory_reset(store: &mut Store<T::Product>) {
        store.reset(false);
    }

    /// Nothing moves by itself.
    fn recover(&mut self) {}

    fn usb_name(&self) -> &'static str {
        T::Product::SPEC.usb
    }

    fn baud_rate(&self) -> Option<u32> {
        None
    }

    fn can_bit_rate(&self) -> Option<u32> {
        self.node.address().map(bit_rate)
    }

    #[inline(always)]
    fn link_settings(&self) -> &LinkSettings {
        &self.settings
    }

    /// A frame first: a telegram over USB is no hurry.
    #[inline(always)]
    fn serve(&mut self, ends: &mut Ends, now: impl Fn() -> Micros) -> bool {
        if ends.can.is_some()
            && let Some(frame) = self.link.read()
        {
            self.node.receive(now(), &frame);
            self.send(ends);
            return true;
        }
        self.serve_usb(ends)
    }

    #[inline(always)]
    fn deadline(&self) -> Micros {
        self.node.deadline()
    }

    #[inline(always)]
    fn takes_inputs(&self, now: Micros) -> bool {
        self.node.takes_inputs(now)
    }

    #[inline(always)]
    fn poll(&mut self, now: Micros, inputs: &Inputs<1>) -> Option<Outputs> {
        Some(self.node.poll(now, inputs))
    }

    fn deliver(&mut self, ends: &mut Ends) {
        if ends.can.is_some() {
            self.look_at_bus(now());
        }
        if self.unknown
            && let Some(address) = self.know()
        {
            can::BIT_RATE.signal(bit_rate(address));
        }
        self.send(ends);
    }

    fn refill(&mut self, ends: &mut Ends) {
        self.send(ends);
    }

    /// All frames are taken.
    fn hold(&self) {}

    /// Off the bus nothing is on its way.
    fn has_sent(&self) -> bool {
        self.bus == BusState::Off || self.link.is_empty()
    }

    #[inline(always)]
    fn next_job(&mut self) -> Option<Job> {
        self.node.store().next_job()
    }

    #[inline(always)]
    fn stored(&mut self, written: bool) {
        self.node.stored(written);
    }

    fn forget(&mut self, _: Source) {}
}
