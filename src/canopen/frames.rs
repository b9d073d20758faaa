//! The frames of a node: what those that come in do, and which go out.

use core::ops::ControlFlow;

use super::Node;
use super::bus::{Bus, BusState, Filter, Filters, Overflow};
use super::cia301::nmt::{Command, Nmt};
use super::cia301::pdo::Received;
use super::cia301::sdo::Asked;
use super::cia301::{Map, Services, cob};
use super::drive::Drive;
use super::entry::Entry;
use super::errors::Emergency;
use super::object::Object;
use super::read::Value;
use super::values::pdos;
use super::write::named;
use super::{COMMAND, CONTROL, SDO_REPLY, SDO_REQUEST};
use crate::can::{CanFrame, Frame, Id, StandardId};
use crate::device::Circuit;
use crate::executor::Product;
use crate::units::Micros;

/// Indices from here on are not of communication; a reset of communication leaves them as they are.
const COMMUNICATION_END: u16 = 0x2000;

impl<T: Circuit<Product: Product>> Node<T> {
    /// Takes a frame from the bus. Frames after one that restarts the node are ignored.
    pub fn receive(&mut self, now: Micros, frame: &Frame) {
        self.now = now;
        let Id::Standard(id) = frame.id() else { return };
        if self.identity.known && self.device.restart().is_none() {
            self.take(id.as_raw(), frame);
            self.look_for_events();
        }
    }

    fn take(&mut self, id: u16, frame: &Frame) {
        let (now, node, values) = (self.now, u16::from(self.identity.address.node), &self.settings.values);
        let Services { state, control, .. } = &mut self.services;
        if frame.is_remote_frame() {
            // A master that gets heartbeats does not guard.
            if id == CONTROL | node && values.of_object(Object::ProducerHeartbeatTime) == 0 {
                control.guard(now, *state);
            }
        } else if id == SDO_REQUEST | node {
            if *state != Nmt::Stopped {
                self.request(frame.data());
            }
        } else if id == values.sync_id() {
            if *state == Nmt::Operational {
                let (services, view) = self.services();
                services.pdos.synchronise(view.reader());
            }
        } else if id == COMMAND {
            self.obey(frame.data());
        } else if id & !0x7F == CONTROL && values.watched() == Some(id & 0x7F) {
            control.hear(now, frame.data());
        } else if *state == Nmt::Operational {
            match self.services.pdos.receive(id, frame) {
                Received::Nothing => {}
                Received::TooShort => self.raise(Emergency::PdoTooShort),
                Received::TooLong => self.raise(Emergency::PdoTooLong),
                Received::Carried(pdo) => self.carry_out(&[pdo]),
            }
        }
    }

    /// Serves a request by SDO.
    fn request(&mut self, request: &[u8]) {
        let asked = match self.services.server.request(request, named, Entry::description) {
            Asked::Read(entry, place) => {
                let (services, view) = self.services();
                match view.read(entry) {
                    Value::Number(number) => services.server.give_number(place, number, entry.row().data.size() as u8),
                    Value::Long(number) => services.server.give(place, &number.to_le_bytes()),
                    Value::Text(text) => services.server.give(place, text.as_bytes()),
                    Value::Octets(octets) => services.server.give(place, &octets),
                }
            }
            Asked::Write(entry, data, confirmation) => {
                let written = self.download(entry, data);
                self.services.server.tell(confirmation, written)
            }
            asked => asked,
        };
        if matches!(asked, Asked::Overflow) {
            self.raise(Emergency::TransmitOverflow);
        }
    }

    /// Obeys a command of the master.
    fn obey(&mut self, data: &[u8]) {
        match Command::of(data, self.identity.address.node) {
            Some(Command::Enter(state)) => {
                self.services.enter(self.now, state);
                if state == Nmt::Stopped {
                    self.command(Drive::leave_master);
                }
            }
            Some(Command::Restart) => self.device.restart_at(self.now),
            Some(Command::ResetCommunication) => self.reset_communication(),
            None => {}
        }
    }

    /// Resets communication: its objects have their saved values again, and the node boots up. Nothing watches over the
    /// master then, so the motor does not go on.
    pub(super) fn reset_communication(&mut self) {
        self.command(Drive::leave_master);
        let Node { now, device, settings, errors, services, identity, lost, .. } = self;
        let values = &mut settings.values;
        values.restore(device.store(), identity.address.node, COMMUNICATION_END);
        if errors.tell_of_lost_settings() {
            lost.lose_again(device.store(), COMMUNICATION_END);
        }
        services.reset(*now, values.milliseconds(Object::ProducerHeartbeatTime));
        for (direction, nth) in pdos() {
            let record = values.record(direction, nth);
            // A record that cannot be is never written, and mended when it is restored.
            if let Ok(map) = Map::of(&record, direction, Entry::described) {
                services.pdos.set_up(*now, (direction, nth), &record, map);
            }
        }
        errors.overlook(Emergency::MasterLost);
        errors.restart();
        (self.manufacturer_mode, self.filters_changed) = (false, true);
    }

    /// Sends what the node has to send, and sees to the filters before, because what a reply confirms is to hold. Off
    /// the bus the node keeps its frames.
    pub fn send(&mut self, bus: &mut impl Bus) {
        if let Some(filters) = self.filters() {
            bus.listen_to(&filters);
        }
        bus.settle();
        if self.bus != BusState::Off {
            while let ControlFlow::Continue(()) = self.send_next(bus) {}
        }
        bus.wait(self.boots);
    }

    fn send_next(&mut self, bus: &mut impl Bus) -> ControlFlow<()> {
        self.boots = self.boots && !bus.is_empty();
        if self.boots || !bus.has_room() {
            return ControlFlow::Break(());
        }
        let Some(frame) = self.next_frame() else { return ControlFlow::Break(()) };
        self.boots = self.is_boot_up(&frame);
        bus.write(&frame);
        ControlFlow::Continue(())
    }

    /// True for the message by which a node tells that it has started: error control, with a state of 0.
    fn is_boot_up(&self, frame: &Frame) -> bool {
        let id = StandardId::new(CONTROL | u16::from(self.identity.address.node));
        id.is_some_and(|id| frame.id() == id.into()) && frame.data() == [0]
    }

    /// Takes note of what has become of the bus since the last look, a millisecond ago at most.
    pub fn look_at(&mut self, now: Micros, bus: &mut impl Bus) {
        if bus.has_overrun() {
            self.lost(now, Overflow::Controller);
        }
        let state = bus.state();
        // But for the boot-up message, all that waits is out of date when the others hear this node again.
        if state == BusState::Off && self.bus != BusState::Off && !self.boots {
            bus.clear();
        }
        self.bus(now, state);
    }

    /// The next frame to be sent. Boot-up and emergencies go first; PDOs go before SDO replies.
    pub fn next_frame(&mut self) -> Option<Frame> {
        if !self.identity.known {
            return None;
        }
        if self.services.control.boots() {
            return self.next_control();
        }
        let frame = self.next_emergency().or_else(|| self.next_pdo());
        frame.or_else(|| self.next_reply()).or_else(|| self.next_control())
    }

    fn next_pdo(&mut self) -> Option<Frame> {
        if !self.services.is_operational() || !self.services.pdos.are_due() {
            return None;
        }
        let now = self.now;
        let (services, view) = self.services();
        services.pdos.next(now, view.reader())
    }

    fn next_reply(&mut self) -> Option<Frame> {
        let reply = self.services.server.next()?;
        Frame::standard(SDO_REPLY | u16::from(self.identity.address.node), &reply)
    }

    fn next_control(&mut self) -> Option<Frame> {
        let message = self.services.control.next()?;
        Frame::standard(CONTROL | u16::from(self.identity.address.node), &[message])
    }

    /// The next emergency message; while emergencies are off none is sent, and what would be is dropped. A node that is
    /// stopped keeps what comes up then until it is started.
    fn next_emergency(&mut self) -> Option<Frame> {
        let (messages, values) = (&mut self.errors.messages, &self.settings.values);
        if !messages.wait(self.services.state == Nmt::Stopped) {
            return None;
        }
        let cob_id = values.of_object(Object::EmergencyCobId);
        if cob_id & cob::OFF != 0 {
            messages.drop_all();
            return None;
        }
        let inhibit = u64::from(values.of_object(Object::EmergencyInhibitTime)).saturating_mul(100);
        Frame::standard(cob::can_id(cob_id), &messages.take(self.now, Micros(inhibit))?)
    }

    /// Tells the node the state of the CAN controller, as often as it is looked at.
    pub fn bus(&mut self, now: Micros, state: BusState) {
        self.now = now;
        let before = core::mem::replace(&mut self.bus, state);
        match (before, state) {
            (BusState::Off, BusState::Active | BusState::Passive) => self.raise(Emergency::BusOff),
            (BusState::Active | BusState::Passive, BusState::Off) => self.lose_master(Drive::leave_bus),
            _ => {}
        }
        if state != BusState::Off {
            self.errors.report(Emergency::ErrorPassive, state == BusState::Passive, None);
        }
    }

    /// Tells the node that frames have been lost.
    pub fn lost(&mut self, now: Micros, place: Overflow) {
        self.now = now;
        self.raise(match place {
            Overflow::Controller => Emergency::ControllerOverflow,
            Overflow::Transmit => Emergency::TransmitOverflow,
            Overflow::Receive => Emergency::ReceiveOverflow,
        });
    }

    /// The frames that the node wants to receive, if they have changed since the last call.
    pub fn filters(&mut self) -> Option<Filters> {
        if !core::mem::take(&mut self.filters_changed) {
            return None;
        }
        let (node, values) = (u16::from(self.identity.address.node), &self.settings.values);
        let mut filters = Filters::new();
        // There is room for all of them.
        let mut add = |id, remote| _ = filters.push(Filter { id, remote });
        for id in [COMMAND, values.sync_id(), SDO_REQUEST | node] {
            add(id, false);
        }
        let watched = values.watched().map(|node| CONTROL | node);
        for id in self.services.pdos.identifiers().chain(watched) {
            add(id, false);
        }
        add(CONTROL | node, true);
        Some(filters)
    }
}
