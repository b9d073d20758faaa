//! The node: its parts, and the ways between them.

use core::fmt;

use super::address::{Address, Identity};
use super::bus::BusState;
use super::cia301::Services;
use super::cia301::abort::Abort;
use super::cia301::nmt::Nmt;
use super::drive::Drive;
use super::entry::Entry;
use super::errors::{Emergency, Errors};
use super::live::Live;
use super::lost::Lost;
use super::settings::Settings;
use super::tunnel::Tunnel;
use crate::device::{Circuit, Device, Inputs, Outputs, Parts, Piece};
use crate::executor::Product;
use crate::motion::{Axis, Events};
use crate::store::{Finished, Need, Store};
use crate::units::Micros;

/// Half the period in which the status LED blinks, in milliseconds.
const BLINK_MS: u64 = 1000;

/// A CANopen node.
pub struct Node<T: Circuit<Product: Product>> {
    pub(super) device: Device<T, 1>,
    /// The time of the last frame or poll.
    pub(super) now: Micros,
    /// No turn has begun since the start.
    is_new: bool,
    /// The identifiers that the node listens to have changed since they were asked for.
    pub(super) filters_changed: bool,
    /// PDOs can be changed while they are valid (2701h).
    pub(super) manufacturer_mode: bool,
    /// The state of the bus as the node knows it.
    pub(super) bus: BusState,
    /// The boot-up message is on its way; nothing else is sent before it, whatever its identifier.
    pub(super) boots: bool,
    pub(super) identity: Identity,
    pub(super) settings: Settings,
    pub(super) live: Live,
    pub(super) errors: Errors,
    /// The objects whose saved values are gone.
    pub(super) lost: Lost,
    pub(super) services: Services<Entry>,
    pub(super) drive: Drive,
    pub(super) tunnel: Tunnel,
}

impl<T: Circuit<Product: Product>> fmt::Debug for Node<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Node { device, identity, services, .. } = self;
        let mut node = f.debug_struct("Node");
        node.field("device", device).field("address", &identity.address).field("state", &services.state).finish()
    }
}

impl<T: Circuit<Product: Product>> Node<T> {
    /// A node before its [start](Self::start). Inlined, as [`Device::new`](crate::device::Device::new) is, so that on
    /// the way to its place the node is on the stack once.
    #[inline(always)]
    pub fn new(parts: Parts<T, 1>) -> Self {
        Node {
            device: Device::new(parts, T::Product::SPEC.axis),
            now: Micros(0),
            is_new: true,
            filters_changed: true,
            manufacturer_mode: false,
            bus: BusState::Active,
            boots: false,
            identity: Identity::UNKNOWN,
            settings: Settings::new(),
            live: Live::default(),
            errors: Errors::default(),
            lost: Lost::default(),
            services: Services::new(),
            drive: Drive::default(),
            tunnel: Tunnel::new::<T::Product>(),
        }
    }

    /// Before the start: the address that the node had before a restart. It is in force if the EEPROM does not tell
    /// another.
    pub const fn remember(&mut self, address: Option<Address>) {
        self.identity.kept = address;
    }

    /// Starts the node: stops the motor, restores the saved objects, sets up the chips, and boots up. The drivers stay
    /// off. `load` fills the store from the EEPROM, which takes some time. Without an [address](Self::address) the node
    /// says nothing.
    pub fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<T::Product>)) {
        let Node { device, settings, identity, .. } = self;
        device.halt();
        device.store_mut().forget();
        load(device.store_mut());
        let lost = Lost::of(device.store());
        identity.take(device.store(), lost.address);
        settings.values.restore(device.store(), identity.address.node, u16::MAX);
        if lost.address {
            settings.values.set_address(identity.address);
        }
        settings.preset(device);
        settings.tell_turn(device);
        let inversion = settings.switches().preset(device);
        device.start(now, inversion);
        device.outputs_mut().digital = 0;
        settings.switch_outputs(device, false);
        settings.switch_pull_ups(device);
        (self.now, self.bus, self.is_new, self.lost) = (now, BusState::Active, true, lost);
        (self.live, self.drive) = (Live::of(device, 0), Drive::default());
        self.reset_communication();
        if self.device.store().is_worn() {
            self.raise(Emergency::SettingsWorn);
        }
    }

    /// The address in force since the start; `None` if it is unknown: then the node must not be on the bus, not even to
    /// acknowledge what others send.
    pub fn address(&self) -> Option<Address> {
        self.identity.known.then_some(self.identity.address)
    }

    /// The node ID in force since the start.
    pub const fn node_id(&self) -> u8 {
        self.identity.address.node
    }

    /// The bit rate in force since the start, in kbit/s.
    pub const fn bit_rate(&self) -> u16 {
        self.identity.address.bit_rate
    }

    /// The state in network management.
    pub const fn state(&self) -> Nmt {
        self.services.state
    }

    /// The axis, to look at.
    pub fn axes(&self) -> &[Axis<T::Hardware>; 1] {
        self.device.axes()
    }

    /// True if a poll at `now` takes the inputs over, as the first of each millisecond does. What inputs note until
    /// they are read, as edges of an encoder, is to be read for such a poll only.
    pub fn takes_inputs(&self, now: Micros) -> bool {
        now.0 >= self.device.deadline().0 && matches!(self.device.next_piece(), Piece::Beginning)
    }

    /// The time at which [`Node::poll`] is to be called next.
    pub fn deadline(&self) -> Micros {
        if self.services.pdos.has_released() { self.device.turn() } else { self.device.deadline() }
    }

    /// True from a command that restarts the node until it does: frames are ignored.
    pub fn is_restarting(&self) -> bool {
        self.device.restart().is_some()
    }

    /// Does all that is due at `now`: to be called at [`Node::deadline`], or as soon after it as can be. Takes the
    /// inputs as they are now, and returns the outputs as they are to be set.
    pub fn poll(&mut self, now: Micros, inputs: &Inputs<1>) -> Outputs {
        self.now = now;
        let released = self.services.pdos.take_released();
        if !released.is_empty() {
            self.carry_out(&released);
        }
        if now >= self.device.deadline() {
            self.take_turn(inputs);
        }
        self.look_for_events();
        let known = self.identity.known;
        let told = self.services.server.is_empty() || self.bus == BusState::Off || !known;
        let due = self.device.restart().is_some_and(|at| now >= at) && self.is_settled() && told;
        let outputs = self.device.outputs_mut();
        outputs.restart = due;
        // LED2 in place of LED1 shows that the address is unknown.
        Outputs { led: outputs.led && known, trouble: outputs.trouble || !known, ..*outputs }
    }

    /// True when all that was saved is durable.
    pub fn is_settled(&self) -> bool {
        self.device.store().settled(Need::Settings)
    }

    /// Tells the node how the EEPROM job that it gave out last has gone. An SDO request that waits for it is answered:
    /// confirmed if all it saved is written.
    pub fn stored(&mut self, written: bool) {
        let Finished { failed, worn, answers, .. } = self.device.store_mut().finish(written);
        // A node without an address starts anew, to read it.
        if answers && !self.identity.known {
            self.device.restart_at(self.now);
        }
        if worn {
            self.raise(Emergency::SettingsWorn);
        }
        if failed.is_some() {
            self.services.server.conclude(Err(Abort::Hardware));
        } else if self.is_settled() {
            self.services.server.conclude(Ok(()));
            let store = self.device.store();
            // What was lost has been replaced. Of an EEPROM that is silent, and is only asked again, all is lost.
            if store.lost() == 0 && !store.is_unreachable() {
                self.lost = Default::default();
            }
        }
    }

    /// The settings on their way to the EEPROM: the caller takes jobs from here and reports how they went.
    pub fn store(&mut self) -> &mut Store<T::Product> {
        self.device.store_mut()
    }

    /// Does the next piece of the turn of each millisecond.
    #[inline(never)]
    fn take_turn(&mut self, inputs: &Inputs<1>) {
        let piece = self.device.next_piece();
        let mut events = Events::default();
        match piece {
            _ if self.tunnel.is_open() => self.tunnel.take_turn(self.now, &mut self.device, inputs),
            // One axis goes on no line.
            Piece::Interpolations => {}
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
        let Node { now, device, settings, live, services, drive, .. } = self;
        let before = live.position;
        services.pdos.touched |= live.take(device);
        // At the home position the motor does not move, but its position becomes another.
        if !drive.finds_home(events) {
            live.count_way(before);
        }
        let is_lost = services.control.turn(*now, services.state, settings.values.times());
        services.pdos.look_at_timers(*now);
        device.outputs_mut().led = (now.millis() / BLINK_MS).is_multiple_of(2);
        let is_new = core::mem::take(&mut self.is_new);
        if is_lost {
            self.lose_master(Drive::lose_master);
        }
        self.command(|drive, plant| {
            if is_new {
                plant.meet_encoder();
            }
            drive.turn(plant, events);
        });
    }
}
