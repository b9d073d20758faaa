//! The CANopen firmware on a simulated board.

use hal_sim::clock::Nanos;
use hal_sim::fault::CanState;
use tmcm::can::{CanFrame, Frame, Id};
use tmcm::canopen::{Address, BusState, Filter, Filters, Node, usb};
use tmcm::module::{LinkEnds, LinkMode, LinkSettings, Request, Source};
use tmcm::product::Tmcm1140Canopen;
use tmcm::store::LoadReport;

use super::board::{Simulated, parts};
use super::firmware::{Firmware, Start, messages};
use super::ports::Ports;
use super::surroundings::{Surroundings, keeper};
use super::traffic::{Ends, Traffic};
use crate::module::Rs485;

/// Frames that the firmware has in a queue on their way to the controller, as on the target. Others wait in the node.
const OUTGOING: usize = 16;

/// The CANopen firmware of the TMCM-1140.
struct Canopen {
    node: Node<Simulated<(), Tmcm1140Canopen>>,
    around: Surroundings<1>,
    /// The frames that pass the controller.
    filters: Filters,
    ports: Ports,
    settings: LinkSettings,
}

/// Starts the CANopen firmware; the messages for a person are about its EEPROM.
pub(super) fn start(Start { board, clock, kept, .. }: Start<'_>) -> (Box<dyn Firmware>, Vec<String>) {
    let mut keeper = keeper(board);
    let mut report = LoadReport::default();
    let mut node = Node::new(parts(board));
    node.remember(kept);
    node.start(clock, |store| report = keeper.load(store));
    let mut messages = messages(&report);
    if node.address().is_none() {
        messages.push("CANopen: the node ID is unknown; 137 over USB starts node 1 with defaults".into());
    }
    let settings = LinkSettings { address: usb::MODULE_ADDRESS, host: usb::HOST_ADDRESS, ..LinkSettings::default() };
    let firmware = Canopen {
        filters: node.filters().unwrap_or_default(),
        node,
        around: Surroundings::new(board, keeper, clock),
        ports: Ports::new(settings.start),
        settings,
    };
    (Box::new(firmware), messages)
}

impl Canopen {
    /// Serves the frame that has come first.
    fn serve_frame(&mut self, traffic: &mut Traffic) -> bool {
        let Some(frame) = traffic.frames_in.pop_front() else { return false };
        self.node.receive(self.around.now(), &frame);
        self.send(traffic);
        true
    }

    /// Serves the telegram that has come first over USB.
    fn serve_telegram(&mut self, traffic: &mut Traffic) -> bool {
        let Canopen { node, around, ports, settings, .. } = self;
        let now = around.now();
        let board = around.board();
        let mut ends = Ends { traffic, ports, board, arrived: board.borrow().now() };
        let Some(request) = ends.request(Source::Usb, settings) else { return false };
        let reply = if let Request::Telegram(telegram) = &request { Some(node.serve_usb(now, telegram)) } else { None };
        ends.answer(Source::Usb.into(), reply.as_ref(), Some(LinkMode::Binary), settings);
        true
    }

    /// Sends what the node has to send; off the bus it keeps that.
    fn send(&mut self, traffic: &mut Traffic) {
        if let Some(filters) = self.node.filters() {
            self.filters = filters;
        }
        if self.around.board().borrow().can() == CanState::Off {
            return;
        }
        while traffic.frames_out.len() < OUTGOING
            && let Some(frame) = self.node.next_frame()
        {
            traffic.frames_out.push_back(frame);
        }
    }
}

impl Firmware for Canopen {
    fn deadline(&self) -> Nanos {
        self.around.when(self.node.deadline())
    }

    fn begins_turn(&self) -> bool {
        self.node.takes_inputs(self.node.deadline())
    }

    fn poll(&mut self, traffic: &mut Traffic) -> bool {
        let Canopen { node, around, .. } = self;
        let now = around.now();
        let inputs = around.inputs(node.takes_inputs(now));
        let outputs = node.poll(now, inputs);
        if let Some(written) = around.keep(now, || node.store().next_job()) {
            node.stored(written);
        }
        around.write(&outputs);
        self.send(traffic);
        outputs.restart
    }

    fn serve(&mut self, traffic: &mut Traffic) -> bool {
        let telegram = self.serve_telegram(traffic);
        self.serve_frame(traffic) || telegram
    }

    fn kept(&self) -> Option<Address> {
        self.node.address()
    }

    fn is_restarting(&self) -> bool {
        self.node.is_restarting()
    }

    fn accepts(&self, frame: &Frame) -> bool {
        let Id::Standard(id) = frame.id() else { return false };
        let wanted = Filter { id: id.as_raw(), remote: frame.is_remote_frame() };
        self.filters.contains(&wanted)
    }

    fn is_addressed(&self, _: &Frame) -> bool {
        true
    }

    fn set_can(&mut self, state: CanState, traffic: &mut Traffic) {
        let state = match state {
            CanState::On => BusState::Active,
            CanState::Passive => BusState::Passive,
            CanState::Off => BusState::Off,
        };
        self.node.bus(self.around.now(), state);
        self.send(traffic);
    }

    /// The firmware leaves the port off.
    fn rs485(&self) -> Option<Rs485> {
        None
    }

    fn ports(&self) -> (&Ports, &LinkSettings) {
        (&self.ports, &self.settings)
    }

    fn ports_mut(&mut self) -> (&mut Ports, &LinkSettings) {
        (&mut self.ports, &self.settings)
    }

    /// True while the reply to a request to save waits until all is saved.
    fn awaits(&self, source: Source) -> bool {
        source == Source::Can && !self.node.is_settled()
    }

    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)> {
        let axis = self.node.axes().get(axis)?;
        Some((axis.last_position(), axis.target_position()))
    }
}
