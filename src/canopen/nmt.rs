//! Network management: the states of the node, the commands of the master, boot-up and heartbeat, and what becomes of
//! the state when the master is lost.

use super::emcy::Emergency;
use super::guard::{Guarded, Heartbeat, Watch};
use super::object::{Entry, Object};
use super::sdo::Server;
use super::store::Tmcm1140;
use super::{CONTROL, Nmt, Node};
use crate::can::Frame;
use crate::device::Board;
use crate::units::Micros;

/// Indices from here on are not of communication; a reset of communication leaves them as they are.
const COMMUNICATION_END: u16 = 0x2000;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Takes a command of the master, which is for one node or, with 0, for all. A frame of another length is none.
    pub(super) fn command(&mut self, data: &[u8]) {
        let [command, node] = data else { return };
        if *node != 0 && *node != self.node {
            return;
        }
        match command {
            0x01 => self.enter(Nmt::Operational),
            0x02 => self.enter(Nmt::Stopped),
            0x80 => self.enter(Nmt::PreOperational),
            0x81 => self.device.restart_at(self.now),
            0x82 => self.reset_communication(),
            _ => {}
        }
    }

    /// Enters a state. PDOs begin anew when the node becomes operational.
    fn enter(&mut self, state: Nmt) {
        if self.state != state {
            self.state = state;
            self.forget_data();
            self.touched = true;
        }
        if state == Nmt::Stopped {
            self.server = Server::default();
            self.leave_master();
        }
    }

    /// The master cannot command the drive any more: a motor that may move, or is about to, is stopped, and FAULT follows.
    fn leave_master(&mut self) {
        if self.drive.state.is_driving() || !self.drive.is_lasting() || self.tunnel.in_tmcl_mode() {
            self.fault();
        }
    }

    /// Resets communication: its objects have their saved values again, and the node boots up. Nothing watches over the
    /// master then, so the motor does not go on.
    pub(super) fn reset_communication(&mut self) {
        self.leave_master();
        self.restore(|row| row.first < COMMUNICATION_END);
        self.state = Nmt::PreOperational;
        self.manufacturer_mode = false;
        self.server = Server::default();
        self.master = Watch::default();
        self.guarding = Watch::default();
        self.errors.note(Emergency::MasterLost, false);
        self.errors.restart();
        self.guarded = Guarded::default();
        self.heartbeat = Heartbeat::begin(self.now, self.milliseconds(Entry::of(Object::ProducerHeartbeatTime)));
        self.control = Some(BOOT_UP);
        self.touched = true;
        self.set_up_pdos();
    }

    /// A master guards this node: it is told the state, unless it gets heartbeats.
    pub(super) fn guard(&mut self) {
        if self.values.of_object(Object::ProducerHeartbeatTime) == 0 {
            self.guarding.hear(self.now);
            // A message that has not been sent, such as the boot-up, goes first; then this question has no answer.
            if self.control.is_none() {
                self.control = Some(self.guarded.answer(self.state as u8));
            }
        }
    }

    /// The node whose heartbeat is watched; `None` if none is.
    pub(super) fn watched(&self) -> Option<u16> {
        let consumer = self.values.of_object(Object::ConsumerHeartbeatTime);
        let node = consumer >> 16;
        ((1..=127).contains(&node) && consumer as u16 != 0).then_some(node as u16)
    }

    /// Looks after the error control in each turn.
    pub(super) fn control_errors(&mut self) {
        let period = self.milliseconds(Entry::of(Object::ProducerHeartbeatTime));
        if period > Micros(0) && self.heartbeat.is_due(self.now, period) && self.control.is_none() {
            self.control = Some(self.state as u8);
        }
        let silence = Micros::from_millis(u64::from(self.values.of_object(Object::ConsumerHeartbeatTime) as u16));
        let guard_time = u64::from(self.values.of_object(Object::GuardTime));
        let factor = u64::from(self.values.of_object(Object::LifeTimeFactor));
        let life = Micros::from_millis(guard_time.saturating_mul(factor));
        let lost = self.master.has_lost(self.now, silence);
        if self.guarding.has_lost(self.now, life) || lost {
            self.lose_master();
        }
    }

    /// The master is lost. That is told, and the drive reacts, before a change of the state.
    fn lose_master(&mut self) {
        self.report(Emergency::MasterLost, true);
        self.lose_services();
    }

    /// The bus or the master is lost: what becomes of the state says 1029h.1.
    pub(super) fn lose_services(&mut self) {
        if self.values.of_object(Object::CommunicationErrorBehaviour) != 1 {
            self.stop_services();
        }
    }

    /// Stops a node that is operational.
    pub(super) fn stop_services(&mut self) {
        if self.state == Nmt::Operational {
            self.errors.say_farewell();
            self.enter(Nmt::Stopped);
        }
    }

    /// The next message of error control.
    pub(super) fn next_control(&mut self) -> Option<Frame> {
        let state = self.control.take()?;
        Frame::standard(CONTROL | u16::from(self.node), &[state])
    }
}

/// The byte of a boot-up message.
pub(super) const BOOT_UP: u8 = 0;
