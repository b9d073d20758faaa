//! The parts of a node as one of them needs the others: what is lent for a call.

use super::Node;
use super::cia301::Services;
use super::cia301::nmt::Nmt;
use super::drive::{Drive, Plant};
use super::entry::Entry;
use super::errors::{Emergency, Reaction};
use super::object::Object;
use super::read::View;
use crate::device::Circuit;
use crate::executor::Product;

impl<T: Circuit<Product: Product>> Node<T> {
    /// The services, and the view from which they read the objects.
    pub(super) fn services(&mut self) -> (&mut Services<Entry>, View<'_, T>) {
        let Node { device, settings, live, errors, drive, tunnel, identity, services, manufacturer_mode, .. } = self;
        let (state, address, manufacturer_mode) = (services.state, identity.address, *manufacturer_mode);
        (services, View { device, settings, live, errors, drive, tunnel, address, state, manufacturer_mode })
    }

    /// The drive, and what it works with. Never inlined: all that a node has to lend is put together in one place.
    #[inline(never)]
    fn drive(&mut self) -> (&mut Drive, Plant<'_, T>) {
        let Node { device, now, settings, live, errors, lost, drive, tunnel, identity, services, bus, .. } = self;
        let plant = Plant {
            now: *now,
            device,
            settings,
            live,
            errors,
            lost: identity.known.then_some(&*lost),
            touched: &mut services.pdos.touched,
            state: services.state,
            bus: *bus,
            has_lost_master: services.control.has_lost_master(),
            in_tmcl_mode: tunnel.is_open(),
        };
        (drive, plant)
    }

    /// Has the drive do something. It may stop the services.
    pub(super) fn command(&mut self, act: impl FnOnce(&mut Drive, &mut Plant<'_, T>)) {
        let (drive, mut plant) = self.drive();
        act(drive, &mut plant);
        if plant.state != self.services.state {
            self.services.enter(self.now, Nmt::Stopped);
        }
    }

    /// Notes an emergency, and has it told. The drive reacts to a fault.
    pub(super) fn raise(&mut self, emergency: Emergency) {
        self.errors.raise(emergency, None);
        if emergency.reaction() == Reaction::Fault {
            self.command(Drive::fault);
        }
    }

    /// The master is lost, to which the drive reacts; what becomes of the state says 1029h.1.
    pub(super) fn lose_master(&mut self, react: impl FnOnce(&mut Drive, &mut Plant<'_, T>)) {
        self.command(|drive, plant| {
            react(drive, plant);
            if plant.settings.of(Object::CommunicationErrorBehaviour) != 1 {
                plant.stop_services();
            }
        });
    }

    /// Has those PDOs sent that carry something else than before. Inlined as far as it asks whether anything has
    /// changed, which is asked after each frame.
    #[inline(always)]
    pub(super) fn look_for_events(&mut self) {
        let touched = self.errors.have_changed() || self.services.pdos.touched;
        if touched && self.services.is_operational() {
            self.find_events();
        } else {
            self.services.pdos.touched = touched;
        }
    }

    #[inline(never)]
    fn find_events(&mut self) {
        let now = self.now;
        let (services, view) = self.services();
        services.pdos.look_for_events(now, view.reader());
    }
}
