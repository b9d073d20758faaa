//! The means with which the drive works while it is called: the motor and all that stands around it, each lent by its
//! owner.

use crate::canopen::bus::BusState;
use crate::canopen::cia301::nmt::Nmt;
use crate::canopen::errors::{Emergency, Errors};
use crate::canopen::live::Live;
use crate::canopen::lost::Lost;
use crate::canopen::object::Object;
use crate::canopen::settings::Settings;
use crate::device::{Circuit, Device};
use crate::units::{Internal, Micros};

/// The state that the statusword shows besides the drive itself.
pub(in crate::canopen) struct Shown<'a, T: Circuit> {
    pub(in crate::canopen) device: &'a Device<T, 1>,
    pub(in crate::canopen) settings: &'a Settings,
    pub(in crate::canopen) live: &'a Live,
    pub(in crate::canopen) errors: &'a Errors,
    pub(in crate::canopen) state: Nmt,
    pub(in crate::canopen) in_tmcl_mode: bool,
}

/// The surroundings of the drive.
pub(in crate::canopen) struct Plant<'a, T: Circuit> {
    pub(in crate::canopen) now: Micros,
    pub(in crate::canopen) device: &'a mut Device<T, 1>,
    pub(in crate::canopen) settings: &'a mut Settings,
    pub(in crate::canopen) live: &'a mut Live,
    pub(in crate::canopen) errors: &'a mut Errors,
    /// The objects whose saved values are gone; `None` if the node has no address, and so nobody whom it could tell.
    pub(in crate::canopen) lost: Option<&'a Lost>,
    /// Something has changed that a PDO may carry.
    pub(in crate::canopen) touched: &'a mut bool,
    /// The state in network management. Where the drive [stops the services](Self::stop_services), it is another one
    /// after the call.
    pub(in crate::canopen) state: Nmt,
    pub(in crate::canopen) bus: BusState,
    pub(in crate::canopen) has_lost_master: bool,
    pub(in crate::canopen) in_tmcl_mode: bool,
}

impl<T: Circuit> Plant<'_, T> {
    /// The part of the plant that the statusword shows.
    pub(super) fn shown(&self) -> Shown<'_, T> {
        Shown {
            device: self.device,
            settings: self.settings,
            live: self.live,
            errors: self.errors,
            state: self.state,
            in_tmcl_mode: self.in_tmcl_mode,
        }
    }

    /// True if the motor stands and is to stand, as its counter has been read. In a homing it is to go on.
    pub(super) fn stands(&self) -> bool {
        stands(self.device)
    }

    /// The acceleration of the quick stop ramp, in internal units.
    pub(super) fn quick_ramp(&self) -> Internal {
        self.settings.acceleration(Object::QuickStopDeceleration)
    }

    /// Notes whether the cause of an emergency exists, and has it told. True if it is a fault that has begun.
    #[inline(always)]
    pub(super) fn report(&mut self, emergency: Emergency, exists: bool) -> bool {
        let names = exists && emergency == Emergency::SettingsLost;
        let named = self.lost.filter(|_| names).and_then(|lost| lost.first());
        self.errors.report(emergency, exists, named)
    }

    /// Slows the motor down to a stand, with this acceleration; one that stands is not told.
    pub(super) fn slow_down(&mut self, acceleration: Internal) {
        if self.stands() {
            return;
        }
        let Some(mut axis) = self.device.axis(0) else { return };
        if axis.rotate_at(self.now, 0, Some(acceleration)).is_err() {
            // The axis tries this again until its chips take it.
            let _ = axis.hard_stop();
        }
    }

    /// Stops the motor without a ramp.
    pub(super) fn stop_hard(&mut self) {
        if let Some(mut axis) = self.device.axis(0) {
            // The axis tries this again until its chips take it.
            let _ = axis.hard_stop();
        }
    }

    /// Stops the motor by the quick stop ramp, whatever it does.
    pub(super) fn end_motion(&mut self) {
        let (now, ramp) = (self.now, self.quick_ramp());
        self.device.end_moves(|axis| axis.rotate_at(now, 0, Some(ramp)));
    }

    /// Makes `position`, in microsteps, the actual position of the motor and of its encoder. The motor stays where it
    /// is.
    pub(super) fn take_position(&mut self, position: i32) {
        if let Some(mut axis) = self.device.axis(0) {
            // A motion controller that does not take it keeps position and encoder as they were.
            let _ = axis.set_positions(self.now, position);
        }
        *self.touched |= self.live.take(self.device);
    }

    /// Stops a node that is operational; the messages that wait are still sent.
    pub(in crate::canopen) fn stop_services(&mut self) {
        if self.state == Nmt::Operational {
            self.errors.messages.say_farewell();
            self.state = Nmt::Stopped;
        }
    }
}

/// True if the motor stands and is to stand, as its counter has been read.
pub(super) fn stands<T: Circuit>(device: &Device<T, 1>) -> bool {
    device.axes().iter().all(|axis| axis.rests() && !axis.searches())
}
