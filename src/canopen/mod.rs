//! The CANopen firmware (manual 001 of the CANopen firmware, V3.20): a [device](crate::device::Device) with one axis, the
//! communication of CiA 301, and the drive of CiA 402.
//!
//! Frames come in by [`Node::receive`] and go out by [`Node::next_frame`]; time and inputs come in by [`Node::poll`].
//! After each `receive` and `poll` the caller takes frames until there is none: so a PDO that a frame has caused leaves
//! before the reply to a later one. The objects are rows of one table ([`ROWS`]); what reading and writing one does
//! stands in `read.rs` and `write.rs`.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod abort;
mod address;
mod cob;
mod drive;
mod emcy;
mod guard;
mod live;
mod lost;
mod map;
mod nmt;
mod object;
mod pdo;
mod read;
mod row;
mod sdo;
mod store;
mod switches;
mod tunnel;
pub mod usb;
mod values;
mod write;

pub use abort::Abort;
pub use address::Address;
pub use emcy::{Emergency, Reaction};
pub use object::{Entry, Object, ROWS, VERSION};
pub use row::{ANY, Access, Initial, Kind, Mapping, Row, Storage, Type, When};
pub use store::Tmcm1140;

use core::fmt;

use heapless::Vec;

use drive::Drive;
use drive::unit::Scale;
use emcy::Errors;
use guard::{Guarded, Heartbeat, Watch};
use live::Live;
use lost::Lost;
use map::PDOS;
use pdo::{Receive, Transmit};
use sdo::Server;
use tunnel::Tunnel;
use values::Values;

use crate::can::{CanFrame, Frame, Id};
use crate::device::{Board, Device, Inputs, Outputs, Parts, Piece};
use crate::motion::{Axis, Events};
use crate::param::tmcm1140::AXIS;
use crate::store::Store;
use crate::units::Micros;

/// Identifier of the commands of the master.
pub const COMMAND: u16 = 0x000;
/// Identifier of SDO replies, without the node ID.
pub const SDO_REPLY: u16 = 0x580;
/// Identifier of SDO requests, without the node ID.
pub const SDO_REQUEST: u16 = 0x600;
/// Identifier of boot-up, heartbeat and guarding, without the node ID.
pub const CONTROL: u16 = 0x700;

/// Half the period in which the status LED blinks, in milliseconds.
const BLINK_MS: u64 = 1000;

/// State of a node in network management, by the numbers of a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Nmt {
    /// Only commands of the master and error control.
    Stopped = 4,
    /// All services.
    Operational = 5,
    /// All services but PDOs.
    PreOperational = 127,
}

/// State of the CAN controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    /// The controller takes part in the bus.
    Active,
    /// It takes part, but has met so many errors that it does not tell others of errors any more.
    Passive,
    /// It takes no part.
    Off,
}

/// Where frames have been lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// In the CAN controller, on their way in.
    Controller,
    /// In the queue of frames that are to be sent.
    Transmit,
    /// In a queue of frames that have been received.
    Receive,
}

/// A frame that the node wants to receive; all others may be kept from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// The identifier, of 11 bits.
    pub id: u16,
    /// Remote frames with this identifier, not data frames.
    pub remote: bool,
}

/// The frames that the node wants to receive: commands, SYNC, SDO requests, guarding, the heartbeat of the master, and
/// four PDOs.
pub type Filters = Vec<Filter, 9>;

/// A CANopen node.
pub struct Node<T: Board<Product = Tmcm1140>> {
    /// The device, which TMCL mode hands to the executor of TMCL.
    device: Device<T, 1>,
    /// TMCL mode.
    tunnel: Tunnel,
    /// The time of the last frame or poll.
    now: Micros,
    /// The node ID in force.
    node: u8,
    /// Node ID and bit rate are known: without them the node is silent.
    known: bool,
    /// Those of before a restart.
    kept: Option<Address>,
    state: Nmt,
    /// No turn has begun since the start.
    is_new: bool,
    /// Something has been written or read that an event-driven PDO may carry.
    touched: bool,
    /// The filters have changed since they were asked for.
    filters_changed: bool,
    /// PDOs can be changed while they are valid (2701h).
    manufacturer_mode: bool,
    bus: BusState,
    /// The byte of a message of error control that is to be sent.
    control: Option<u8>,
    /// The bit rate in force, in kbit/s.
    bit_rate: u16,
    values: Values,
    /// What the motion controller makes of velocities and accelerations, by the values.
    scale: Scale,
    live: Live,
    /// The motor's way in both directions, in microsteps.
    way: u64,
    server: Server,
    receive: [Receive; PDOS as usize],
    transmit: [Transmit; PDOS as usize],
    errors: Errors,
    /// The objects whose saved values are gone.
    lost: Lost,
    drive: Drive,
    heartbeat: Heartbeat,
    guarded: Guarded,
    /// The watch over the master by its guarding, and by its heartbeat.
    guarding: Watch,
    master: Watch,
}

impl<T: Board<Product = Tmcm1140>> fmt::Debug for Node<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Node { device, node, state, .. } = self;
        f.debug_struct("Node").field("device", device).field("node", node).field("state", state).finish()
    }
}

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// A node before its [start](Self::start). Inlined, as [`Device::new`](crate::device::Device::new) is, so that on the
    /// way to its place the node is on the stack once.
    #[inline(always)]
    pub fn new(parts: Parts<T, 1>) -> Self {
        Node {
            device: Device::new(parts, &AXIS),
            tunnel: Tunnel::new(),
            now: Micros(0),
            node: Address::DEFAULT.node,
            known: false,
            kept: None,
            state: Nmt::PreOperational,
            is_new: true,
            touched: false,
            filters_changed: true,
            manufacturer_mode: false,
            bus: BusState::Active,
            control: None,
            bit_rate: Address::DEFAULT.bit_rate,
            values: Values::of(1),
            scale: Scale::START,
            live: Live::default(),
            way: 0,
            server: Server::default(),
            receive: [Receive::OFF; _],
            transmit: [Transmit::OFF; _],
            errors: Errors::default(),
            lost: Lost::default(),
            drive: Drive::default(),
            heartbeat: Heartbeat::default(),
            guarded: Guarded::default(),
            guarding: Watch::default(),
            master: Watch::default(),
        }
    }

    /// Before the start: the address that the node had before a restart. It is in force if the EEPROM does not tell another.
    pub const fn remember(&mut self, address: Option<Address>) {
        self.kept = address;
    }

    /// Starts the node: stops the motor, restores the saved objects, sets up the chips, and boots up. The drivers stay
    /// off. `load` fills the store from the EEPROM, which takes some time. Without an [address](Self::address) the node says
    /// nothing.
    pub fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<Tmcm1140>)) {
        self.device.halt();
        let store = self.device.store_mut();
        store.forget();
        load(store);
        (self.now, self.bus, self.way) = (now, BusState::Active, 0);
        self.lost = Lost::of(self.device.store());
        self.take_addresses();
        self.restore(|_| true);
        self.preset_parameters();
        self.tell_turn();
        let inversion = self.preset_switches();
        self.device.start(now, inversion);
        self.is_new = true;
        self.drive = Drive::default();
        self.device.outputs_mut().digital = 0;
        self.switch_outputs();
        self.switch_pull_ups();
        self.live = Live::of(&mut self.device);
        self.reset_communication();
        if self.device.store().is_worn() {
            self.raise(Emergency::SettingsWorn);
        }
    }

    /// The address in force since the start; `None` if it is unknown: then the node must not be on the bus, not even to
    /// acknowledge what others send.
    pub fn address(&self) -> Option<Address> {
        self.known.then_some(Address { node: self.node, bit_rate: self.bit_rate })
    }

    /// Starts a node without an address as node 1 at 1 Mbit/s, with defaults: they are what it has. False if it has an
    /// address.
    fn start_with_defaults(&mut self) -> bool {
        if self.known {
            return false;
        }
        (self.known, self.lost) = (true, Lost::default());
        if !self.device.store().is_unreachable() {
            self.device.store_mut().reset(false);
        }
        self.reset_communication();
        self.filters_changed = true;
        true
    }

    /// The node ID in force since the start.
    pub const fn node_id(&self) -> u8 {
        self.node
    }

    /// The bit rate in force since the start, in kbit/s.
    pub const fn bit_rate(&self) -> u16 {
        self.bit_rate
    }

    /// The state in network management.
    pub const fn state(&self) -> Nmt {
        self.state
    }

    /// The axis, to look at.
    pub fn axes(&self) -> &[Axis<T::Hardware>; 1] {
        self.device.axes()
    }

    /// Takes a frame from the bus. Frames after one that restarts the node are ignored.
    pub fn receive(&mut self, now: Micros, frame: &Frame) {
        self.now = now;
        let Id::Standard(id) = frame.id() else { return };
        if !self.known || self.device.restart().is_some() {
            return;
        }
        self.take(id.as_raw(), frame);
        if self.touched {
            self.look_for_events();
        }
    }

    fn take(&mut self, id: u16, frame: &Frame) {
        let node = u16::from(self.node);
        if frame.is_remote_frame() {
            if id == CONTROL | node {
                self.guard();
            }
        } else if id == SDO_REQUEST | node {
            if self.state != Nmt::Stopped && !self.request(frame.data()) {
                self.raise(Emergency::TransmitOverflow);
            }
        } else if id == cob::can_id(self.values.of_object(Object::SyncCobId)) {
            self.synchronise();
        } else if id == COMMAND {
            self.command(frame.data());
        } else if id & !0x7F == CONTROL && self.watched() == Some(id & 0x7F) {
            // A boot-up message is no heartbeat: a master that starts may not have set up its own yet.
            if frame.data() != [nmt::BOOT_UP] {
                self.master.hear(self.now);
            }
        } else {
            self.receive_pdo(id, frame);
        }
    }

    /// The next frame to be sent. Boot-up and emergencies go first; PDOs go before SDO replies.
    pub fn next_frame(&mut self) -> Option<Frame> {
        if !self.known {
            return None;
        }
        if self.control == Some(nmt::BOOT_UP) {
            return self.next_control();
        }
        let frame = self.next_emergency();
        let frame = frame.or_else(|| self.next_pdo()).or_else(|| self.next_reply());
        frame.or_else(|| self.next_control())
    }

    fn next_reply(&mut self) -> Option<Frame> {
        let reply = self.server.next()?;
        Frame::standard(SDO_REPLY | u16::from(self.node), &reply)
    }

    /// The next emergency message; while emergencies are off none is sent, and what would be is dropped. A node that is
    /// stopped keeps what comes up then until it is started.
    fn next_emergency(&mut self) -> Option<Frame> {
        if !self.errors.has_message(self.state == Nmt::Stopped) {
            return None;
        }
        let cob_id = self.values.of_object(Object::EmergencyCobId);
        if cob_id & cob::OFF != 0 {
            self.errors.drop_messages();
            return None;
        }
        let inhibit = u64::from(self.values.of_object(Object::EmergencyInhibitTime)).saturating_mul(100);
        let message = self.errors.take(self.now, Micros(inhibit))?;
        Frame::standard(cob::can_id(cob_id), &message)
    }

    /// Notes an emergency, and has it told. The drive reacts to a fault.
    fn raise(&mut self, emergency: Emergency) {
        self.errors.raise(emergency, self.lost.first().filter(|_| emergency == Emergency::SettingsLost));
        if emergency.reaction() == Reaction::Fault {
            self.fault();
        }
    }

    /// Tells the node the state of the CAN controller, as often as it is looked at.
    pub fn bus(&mut self, now: Micros, state: BusState) {
        self.now = now;
        let before = core::mem::replace(&mut self.bus, state);
        match (before, state) {
            (BusState::Off, BusState::Active | BusState::Passive) => self.raise(Emergency::BusOff),
            (BusState::Active | BusState::Passive, BusState::Off) => self.leave_bus(),
            _ => {}
        }
        if state != BusState::Off {
            self.report(Emergency::ErrorPassive, state == BusState::Passive);
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
        let node = u16::from(self.node);
        let sync = cob::can_id(self.values.of_object(Object::SyncCobId));
        let mut filters = Filters::new();
        // There is room for all of them.
        let mut add = |id, remote| _ = filters.push(Filter { id, remote });
        for id in [COMMAND, sync, SDO_REQUEST | node] {
            add(id, false);
        }
        let watched = self.watched().map(|node| CONTROL | node);
        for id in self.receive.iter().filter_map(|pdo| pdo.id).chain(watched) {
            add(id, false);
        }
        add(CONTROL | node, true);
        Some(filters)
    }

    /// True if a poll at `now` takes the inputs over, as the first of each millisecond does. What inputs note until they
    /// are read, as edges of an encoder, is to be read for such a poll only.
    pub fn takes_inputs(&self, now: Micros) -> bool {
        now.0 >= self.device.deadline().0 && matches!(self.device.next_piece(), Piece::Beginning)
    }

    /// The time at which [`Node::poll`] is to be called next.
    pub fn deadline(&self) -> Micros {
        if self.has_released() { self.device.turn() } else { self.device.deadline() }
    }

    /// True from a command that restarts the node until it does: frames are ignored.
    pub fn is_restarting(&self) -> bool {
        self.device.restart().is_some()
    }

    /// Does all that is due at `now`: to be called at [`Node::deadline`], or as soon after it as can be. Takes the inputs
    /// as they are now, and returns the outputs as they are to be set.
    pub fn poll(&mut self, now: Micros, inputs: &Inputs<1>) -> Outputs {
        self.now = now;
        self.act();
        if now >= self.device.deadline() {
            self.take_turn(inputs);
        }
        if self.touched {
            self.look_for_events();
        }
        let told = self.server.is_empty() || self.bus == BusState::Off || !self.known;
        let due = self.device.restart().is_some_and(|at| now >= at) && self.is_settled() && told;
        let outputs = self.device.outputs_mut();
        outputs.restart = due;
        // LED2 in place of LED1 shows that the address is unknown.
        Outputs { led: outputs.led && self.known, trouble: outputs.trouble || !self.known, ..*outputs }
    }

    /// Takes over what the device has read.
    fn read_live(&mut self) {
        let live = Live::of(&mut self.device);
        self.touched |= live != self.live;
        self.live = live;
    }

    /// Does the next piece of the turn of each millisecond.
    #[inline(never)]
    fn take_turn(&mut self, inputs: &Inputs<1>) {
        let piece = self.device.next_piece();
        let mut events = Events::default();
        match piece {
            _ if self.tunnel.in_tmcl_mode() => self.tunnel.take_turn(&mut self.device, self.now, inputs),
            // One axis goes on no line.
            Piece::Lines => {}
            Piece::Reading => self.device.next_reading(),
            Piece::Axis | Piece::Beginning => {
                if piece == Piece::Beginning {
                    self.device.begin(self.now, inputs);
                }
                (_, events) = self.device.next_axis(self.now);
            }
        }
        if piece == Piece::Reading {
            return;
        }
        let before = self.live.position;
        self.read_live();
        // At the home position the motor does not move, but its position becomes another.
        let way = if self.finds_home(events) { 0 } else { self.live.position.wrapping_sub(before).unsigned_abs() };
        self.way = self.way.wrapping_add(way.into());
        if core::mem::take(&mut self.is_new) {
            self.meet_encoder();
        }
        self.control_errors();
        self.drive(events);
        self.look_at_timers();
        self.device.outputs_mut().led = (self.now.millis() / BLINK_MS).is_multiple_of(2);
    }
}
