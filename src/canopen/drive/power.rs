//! The way from one state of the drive to another: ramps, the brake at OUT0, and the bridges (manual sections 4.2.3,
//! 4.2.7, 4.2.9 and 5.1).
//!
//! | way | steps |
//! |---|---|
//! | to OPERATION ENABLED | bridges on; after 200Ah ms (50 ms at least if the shaft has been turned meanwhile) the brake is released; after 2002h.2 ms the state is entered |
//! | from there or from QUICK STOP ACTIVE | the motor stops as the command says; the brake is applied; after 2002h.1 ms the bridges are off and the state is entered |
//!
//! So the state changes at the end of the way. A command that comes before waits for that end, unless it leads to a
//! stop: on the way to OPERATION ENABLED every other command turns back, and a ramp gives way to a quicker stop.

use super::state::{Command, State};
use super::{Limits, Way};
use crate::canopen::Node;
use crate::canopen::object::Object;
use crate::canopen::store::Tmcm1140;
use crate::device::Board;
use crate::units::Micros;

/// The option codes (605Ah) with which a quick stop uses the ramp of the mode, not its own.
const SLOW_DOWN: [u32; 2] = [1, 5];
/// The option codes with which QUICK STOP ACTIVE lasts.
const LASTING: [u32; 2] = [5, 6];

/// Time in which the current draws a rotor to the field.
const SNAP: Micros = Micros::from_millis(50);

/// The bit of a fault reset in a controlword.
const FAULT_RESET: u16 = 1 << 7;
/// From this current on (200Ch, in 1/255) OUT0, which can only be on or off, is on.
const ON: u32 = 128;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Obeys a controlword: commands, fault reset, and the bits of the mode of operation.
    pub(in crate::canopen) fn obey(&mut self, word: u16) {
        let before = core::mem::replace(&mut self.drive.controlword, word);
        let operates = self.drive.is_operating();
        if word & !before & FAULT_RESET != 0 {
            self.reset_fault();
        }
        self.obey_command();
        self.progress();
        self.operate(before, operates);
        self.steer();
    }

    /// Carries out the command of the controlword, or lets it wait.
    fn obey_command(&mut self) {
        let Some(command) = Command::of(self.drive.controlword) else { return };
        let state = self.drive.state;
        let lasts = LASTING.contains(&self.values.of_object(Object::QuickStopOption));
        let to = state.after(command, lasts);
        match self.drive.way {
            Way::Lasting => {}
            Way::Energising(_) | Way::Releasing(_) => {
                if command != Command::EnableOperation {
                    self.disable(to.unwrap_or(state));
                }
                return;
            }
            Way::Stopping(_) if to.is_some_and(|to| to != State::OperationEnabled && to != State::SwitchedOn) => {}
            Way::Stopping(_) | Way::Applying(..) => {
                self.drive.waiting = true;
                return;
            }
        }
        match to {
            None => {}
            Some(State::OperationEnabled) if state == State::QuickStopActive => {
                self.enter_state(State::OperationEnabled)
            }
            Some(State::OperationEnabled) => {
                self.enter_state(State::SwitchedOn);
                self.energise();
            }
            Some(State::QuickStopActive) => self.quick_stop(lasts),
            Some(State::SwitchedOn) if state.is_driving() => {
                self.slow_down(self.ramp());
                self.drive.way = Way::Stopping(State::SwitchedOn);
            }
            Some(to) if state.is_driving() => self.disable(to),
            Some(to) => self.enter_state(to),
        }
    }

    /// Goes on with the way to the next state, as far as it can be gone now, and then carries out a command that waits.
    pub(in crate::canopen) fn progress(&mut self) {
        loop {
            match self.drive.way {
                Way::Energising(at) if self.now >= at => {
                    if core::mem::take(&mut self.drive.turned) {
                        self.follow_encoder();
                    }
                    self.release_brake(true);
                    self.drive.way = Way::Releasing(self.after(Object::BrakeReleaseDelay));
                }
                Way::Releasing(at) if self.now >= at && self.tunnel.in_tmcl_mode() => self.drive.way = Way::Lasting,
                Way::Releasing(at) if self.now >= at => self.enter_state(State::OperationEnabled),
                // A motion controller that is silent tells of no stop; the bridges are off then anyway.
                Way::Stopping(to) if self.stands() || self.device.is_given_up() => self.disable(to),
                Way::Applying(at, to) if self.now >= at => {
                    self.device.enable_drivers(false);
                    self.drive.held = None;
                    self.enter_state(to);
                }
                Way::Lasting if core::mem::take(&mut self.drive.waiting) => self.obey_command(),
                _ => return,
            }
        }
    }

    /// Enters a state. What the motor was to do is forgotten.
    pub(super) fn enter_state(&mut self, state: State) {
        (self.drive.state, self.drive.way) = (state, Way::Lasting);
        self.forget_motion();
        self.touched = true;
    }

    /// Begins the way to OPERATION ENABLED. A rotor that has been turned has the time to be drawn to the field.
    fn energise(&mut self) {
        self.device.enable_drivers(true);
        let (held, enabled) = (self.now.after(SNAP), self.after(Object::EnableDelay));
        self.drive.held = Some(held);
        self.drive.turned = self.deviates();
        self.drive.way = Way::Energising(if self.drive.turned { held.max(enabled) } else { enabled });
    }

    /// True while settings can be written that change only in SWITCH ON DISABLED: in TMCL mode the motor may move then.
    pub(in crate::canopen) fn is_disabled(&self) -> bool {
        self.drive.state == State::SwitchOnDisabled && !self.tunnel.in_tmcl_mode()
    }

    /// TMCL mode begins: the motor stops by the quick stop ramp, and the drive is SWITCH ON DISABLED. But the bridges stay
    /// on and the brake stays released, or both come as on the way to OPERATION ENABLED.
    pub(in crate::canopen) fn yield_motor(&mut self) {
        let holds = self.drive.state.is_driving() && self.drive.released;
        self.end_motion();
        self.abort_homing();
        self.drive.waiting = false;
        self.drive.limits = Limits::default();
        self.enter_state(State::SwitchOnDisabled);
        if !holds {
            self.energise();
        }
    }

    /// Stops the motor by the quick stop ramp, whatever it does.
    pub(super) fn end_motion(&mut self) {
        let (now, ramp) = (self.now, self.quick_ramp());
        self.device.end_moves(|axis| axis.rotate_at(now, 0, Some(ramp)));
    }

    /// Begins the way to a state in which the bridges are off. The motor does not move any more.
    pub(super) fn disable(&mut self, to: State) {
        if !self.stands() {
            self.stop_hard();
        }
        self.abort_homing();
        self.release_brake(false);
        self.drive.way = Way::Applying(self.after(Object::BrakeApplyDelay), to);
    }

    /// Stops the motor as the quick stop option code says; the state lasts, or SWITCH ON DISABLED follows.
    fn quick_stop(&mut self, lasts: bool) {
        let slow = SLOW_DOWN.contains(&self.values.of_object(Object::QuickStopOption));
        let ramp = if slow { self.ramp() } else { self.quick_ramp() };
        self.enter_state(State::QuickStopActive);
        self.slow_down(ramp);
        if !lasts {
            self.drive.way = Way::Stopping(State::SwitchOnDisabled);
        }
    }

    /// Releases the brake, or applies it.
    fn release_brake(&mut self, released: bool) {
        self.drive.released = released;
        self.switch_outputs();
    }

    /// The level of OUT0 as the brake needs it; `None` if there is no automatic brake, because both currents are 0.
    pub(in crate::canopen) fn brake(&self) -> Option<bool> {
        let [apply, release] =
            [Object::BrakeApplyCurrent, Object::BrakeReleaseCurrent].map(|object| self.values.of_object(object));
        let current = if self.drive.released { release } else { apply };
        (apply != 0 || release != 0).then_some(current >= ON)
    }

    /// The time at which a delay that begins now is over.
    fn after(&self, delay: Object) -> Micros {
        self.now.after(Micros::from_millis(self.values.of_object(delay).into()))
    }
}
