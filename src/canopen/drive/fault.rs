//! The faults of the drive: their causes, which are looked for in each turn, the reaction, and the reset (manual section
//! 5.1.5 and chapter 10). What each emergency leads to is in the table of `emcy.rs`.

use super::Way;
use super::state::State;
use crate::canopen::emcy::{Change, Emergency as E, Reaction};
use crate::canopen::live::flags;
use crate::canopen::object::Object;
use crate::canopen::store::Tmcm1140;
use crate::canopen::{BusState, Nmt, Node};
use crate::device::Board;

/// Bit of 2005h: the shutdown input is in use.
const SHUTDOWN_INPUT: u32 = 1 << 6;
/// The shutdown input, IN0. While it is low, the signal that lets the motor run is missing.
const IN0: u16 = 1;

/// Number of turns, one in a millisecond, for which the driver tells of an open load before that counts. Its flags are
/// right only while the motor moves with some current (TMC262 datasheet, chapter on diagnostics).
const OPEN_LOAD: u8 = 20;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Looks for the causes of emergencies that last for a time, once in each turn. The beginning of each is told, and
    /// has its reaction.
    pub(super) fn look_for_faults(&mut self) {
        let moves = self.live.speed != 0;
        for (turns, flag) in self.drive.open_load.iter_mut().zip([flags::OPEN_A, flags::OPEN_B]) {
            *turns = if moves && self.live.flags & flag != 0 { turns.saturating_add(1) } else { 0 };
        }
        let [open_a, open_b] = self.drive.open_load.map(|turns| turns >= OPEN_LOAD);
        let flag = |flag| self.live.flags & flag != 0;
        // A node without an address has nobody whom it could tell.
        let is_unknown = self.known && !self.lost.is_empty();
        let shutdown = self.values.of_object(Object::LimitSwitches) & SHUTDOWN_INPUT != 0;
        let causes = [
            (E::OpenLoadA, open_a),
            (E::OpenLoadB, open_b),
            (E::OverCurrentA, flag(flags::SHORT_A)),
            (E::OverCurrentB, flag(flags::SHORT_B)),
            (E::TemperatureWarning, flag(flags::WARNING)),
            (E::OverTemperature, flag(flags::OVERTEMPERATURE)),
            (E::SilentController, self.device.is_given_up()),
            (E::SilentEeprom, is_unknown && self.device.store().is_unreachable()),
            (E::SettingsLost, is_unknown && !self.device.store().is_unreachable()),
            (E::Shutdown, shutdown && self.live.inputs & IN0 == 0),
            (E::MasterLost, self.master.is_lost() || self.guarding.is_lost()),
            (E::FollowingError, self.has_following_error()),
            (E::UnderVoltage, self.device.lacks_supply()),
        ];
        if self.errors.are_noted(&causes) {
            return;
        }
        for (emergency, exists) in causes {
            self.report(emergency, exists);
        }
    }

    /// Notes whether the cause of an emergency exists, which is raised when it begins to. When it has ended, an error that
    /// is no fault is over; a fault stays until it is reset.
    pub(in crate::canopen) fn report(&mut self, emergency: E, exists: bool) {
        match self.errors.note(emergency, exists) {
            Change::Begun => self.raise(emergency),
            Change::Ended if emergency.reaction() != Reaction::Fault => self.errors.end(emergency),
            Change::Ended | Change::None => {}
        }
    }

    /// A fault has come up: the motor is stopped by the quick stop ramp, and FAULT follows; but in TMCL mode there are no
    /// states.
    pub(in crate::canopen) fn fault(&mut self) {
        if matches!(self.drive.state, State::FaultReactionActive | State::Fault) {
            return;
        }
        if self.tunnel.in_tmcl_mode() {
            self.end_motion();
        } else {
            self.react();
        }
        if self.values.of_object(Object::ApplicationErrorBehaviour) != 1 {
            self.stop_services();
        }
    }

    /// Begins the way to FAULT.
    fn react(&mut self) {
        let (state, way) = (self.drive.state, self.drive.way);
        self.abort_homing();
        self.enter_state(State::FaultReactionActive);
        match way {
            Way::Applying(at, _) => self.drive.way = Way::Applying(at, State::Fault),
            Way::Energising(_) | Way::Releasing(_) => self.disable(State::Fault),
            Way::Lasting | Way::Stopping(_) if state.is_driving() => {
                self.slow_down(self.quick_ramp());
                self.drive.way = Way::Stopping(State::Fault);
            }
            Way::Lasting | Way::Stopping(_) => self.enter_state(State::Fault),
        }
        self.progress();
    }

    /// The CAN controller is off the bus: nothing can be commanded any more, so the motor stops without a ramp.
    pub(in crate::canopen) fn leave_bus(&mut self) {
        if self.drive.state.is_driving() || self.tunnel.in_tmcl_mode() {
            self.stop_hard();
        }
        self.fault();
        self.lose_services();
    }

    /// Resets a fault (transition 15), if all causes are gone. In other states the error register forgets what is gone.
    pub(super) fn reset_fault(&mut self) {
        if self.drive.state == State::Fault {
            let barred = self.bus == BusState::Off || self.state == Nmt::Stopped || self.errors.holds_fault();
            if barred {
                return;
            }
            self.follow_encoder();
            self.enter_state(State::SwitchOnDisabled);
            self.errors.forget();
            self.raise(E::Reset);
        } else {
            self.errors.forget();
        }
    }
}
