//! The way from one state of the drive to another: ramps, the brake at OUT0, and the bridges (manual sections 4.2.3,
//! 4.2.7, 4.2.9 and 5.1).
//!
//! | way | steps |
//! |---|---|
//! | to OPERATION ENABLED | bridges on; after 200Ah ms (50 ms at least if the shaft has been turned meanwhile) the brake is released; after 2002h.2 ms the state is entered |
//! | from there or from QUICK STOP ACTIVE | the motor stops as the command says; the brake is applied; after 2002h.1 ms the bridges are off and the state is entered |
//!
//! So the state changes at the end of the way. A command that comes before waits for that end, unless it leads to a
//! stop. On the way to OPERATION ENABLED every other command turns back, and a ramp gives way to a quicker stop.

use super::plant::Plant;
use super::state::{Command, State};
use crate::canopen::object::Object;
use crate::device::Circuit;
use crate::units::Micros;

/// The option codes (605Ah) with which a quick stop uses the ramp of the mode, not its own.
const SLOW_DOWN: [u32; 2] = [1, 5];
/// The option codes with which QUICK STOP ACTIVE lasts.
const LASTING: [u32; 2] = [5, 6];

/// Time in which the current draws a rotor to the field.
const SNAP: Micros = Micros::from_millis(50);

/// The work of the drive on its way to another state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Transition {
    /// Nothing: the state lasts.
    #[default]
    Lasting,
    /// The bridges are on, and the brake is released at this time.
    Energising(Micros),
    /// The brake is released, and OPERATION ENABLED is entered at this time.
    Releasing(Micros),
    /// The motor slows down, and the bridges go off for this state when it stands.
    Stopping(State),
    /// The brake is applied; at this time the bridges go off, and the state is entered.
    Applying(Micros, State),
}

/// The state of the drive, its bridges and its brake.
#[derive(Debug, Default)]
pub(super) struct Power {
    state: State,
    way: Transition,
    /// A controlword has come on the way to a state, and is obeyed there.
    waiting: bool,
    /// The brake is released.
    released: bool,
    /// The bridges are on, and at this time the current has drawn the rotor to the field: from then on there can be a
    /// following error. `None` while the bridges are off.
    held: Option<Micros>,
    /// The shaft has been turned while the bridges were off: once the rotor is held, the counter is to follow the
    /// encoder.
    turned: bool,
    /// The changes since they were last asked for.
    changes: Changes,
}

/// The changes that a call has led to, for those to whom they mean an end.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Changes {
    /// A state has been entered: what the motor was to do is forgotten.
    pub(super) entered: bool,
    /// The way to a state has begun in which the bridges are off: a homing is over.
    pub(super) disabled: bool,
}

/// A controlword, and the object that has the acceleration of ramps in the mode of operation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Orders {
    pub(super) word: u16,
    pub(super) ramp: Object,
}

impl Power {
    pub(super) const fn state(&self) -> State {
        self.state
    }

    /// True while the drive is on no way to another state.
    pub(super) fn is_lasting(&self) -> bool {
        self.way == Transition::Lasting
    }

    /// True while there is nothing to go on with, and nothing has happened that was not asked for.
    pub(super) fn is_quiet(&self) -> bool {
        let Changes { entered, disabled } = self.changes;
        self.is_lasting() && !self.waiting && !entered && !disabled
    }

    /// True while the motor obeys the mode of operation.
    pub(super) const fn is_operating(&self) -> bool {
        matches!((self.state, self.way), (State::OperationEnabled, Transition::Lasting))
    }

    /// True while the brake is released.
    pub(super) const fn is_released(&self) -> bool {
        self.released
    }

    /// Takes the changes since this was last asked.
    pub(super) fn take_changes(&mut self) -> Changes {
        core::mem::take(&mut self.changes)
    }

    /// True if a motor that is held, and may be moving, is outside the window of 6065h.
    pub(super) fn has_following_error<T: Circuit>(&self, plant: &Plant<'_, T>) -> bool {
        let window = plant.settings.of(Object::FollowingErrorWindow);
        // With an off time of 0 the bridges are off as well.
        let held = self.held.is_some_and(|held| plant.now >= held) && plant.settings.of(Object::ChopperOffTime) != 0;
        held && !self.turned && window != 0 && plant.live.following_error().unsigned_abs() > window
    }

    /// Carries out the command of the controlword, or lets it wait.
    pub(super) fn obey<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, orders: Orders) {
        let Some(command) = Command::of(orders.word) else { return };
        let state = self.state;
        let lasts = LASTING.contains(&plant.settings.of(Object::QuickStopOption));
        let to = state.after(command, lasts);
        match self.way {
            Transition::Lasting => {}
            Transition::Energising(_) | Transition::Releasing(_) => {
                if command != Command::EnableOperation {
                    self.disable(plant, to.unwrap_or(state));
                }
                return;
            }
            Transition::Stopping(_)
                if to.is_some_and(|to| to != State::OperationEnabled && to != State::SwitchedOn) => {}
            Transition::Stopping(_) | Transition::Applying(..) => {
                self.waiting = true;
                return;
            }
        }
        match to {
            None => {}
            Some(State::OperationEnabled) if state == State::QuickStopActive => self.enter(State::OperationEnabled),
            Some(State::OperationEnabled) => {
                self.enter(State::SwitchedOn);
                self.energise(plant);
            }
            Some(State::QuickStopActive) => self.quick_stop(plant, orders.ramp, lasts),
            Some(State::SwitchedOn) if state.is_driving() => {
                plant.slow_down(plant.settings.acceleration(orders.ramp));
                self.way = Transition::Stopping(State::SwitchedOn);
            }
            Some(to) if state.is_driving() => self.disable(plant, to),
            Some(to) => self.enter(to),
        }
    }

    /// Goes on with the way to the next state, as far as it can be gone now, and then carries out a command that waits.
    pub(super) fn progress<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, orders: Orders) {
        loop {
            match self.way {
                Transition::Energising(at) if plant.now >= at => {
                    if core::mem::take(&mut self.turned) {
                        plant.follow_encoder();
                    }
                    self.release_brake(plant, true);
                    self.way = Transition::Releasing(plant.settings.after(plant.now, Object::BrakeReleaseDelay));
                }
                Transition::Releasing(at) if plant.now >= at && plant.in_tmcl_mode => self.way = Transition::Lasting,
                Transition::Releasing(at) if plant.now >= at => self.enter(State::OperationEnabled),
                // A motion controller that is silent tells of no stop; the bridges are off then anyway.
                Transition::Stopping(to) if plant.stands() || plant.device.is_given_up() => self.disable(plant, to),
                Transition::Applying(at, to) if plant.now >= at => {
                    plant.device.enable_drivers(false);
                    self.held = None;
                    self.enter(to);
                }
                Transition::Lasting if core::mem::take(&mut self.waiting) => self.obey(plant, orders),
                _ => return,
            }
        }
    }

    /// Enters a state.
    pub(super) const fn enter(&mut self, state: State) {
        (self.state, self.way, self.changes.entered) = (state, Transition::Lasting, true);
    }

    /// Begins the way to OPERATION ENABLED. A rotor that has been turned has the time to be drawn to the field.
    fn energise<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        plant.device.enable_drivers(true);
        let (held, enabled) = (plant.now.after(SNAP), plant.settings.after(plant.now, Object::EnableDelay));
        self.held = Some(held);
        self.turned = plant.deviates();
        self.way = Transition::Energising(if self.turned { held.max(enabled) } else { enabled });
    }

    /// TMCL mode begins: the drive is SWITCH ON DISABLED. But the bridges stay on and the brake stays released, or both
    /// come as on the way to OPERATION ENABLED.
    pub(super) fn yield_motor<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        let holds = self.state.is_driving() && self.released;
        self.waiting = false;
        self.enter(State::SwitchOnDisabled);
        if !holds {
            self.energise(plant);
        }
    }

    /// Begins the way to FAULT.
    pub(super) fn react<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        let (state, way) = (self.state, self.way);
        self.enter(State::FaultReactionActive);
        match way {
            Transition::Applying(at, _) => self.way = Transition::Applying(at, State::Fault),
            Transition::Energising(_) | Transition::Releasing(_) => self.disable(plant, State::Fault),
            Transition::Lasting | Transition::Stopping(_) if state.is_driving() => {
                plant.slow_down(plant.quick_ramp());
                self.way = Transition::Stopping(State::Fault);
            }
            Transition::Lasting | Transition::Stopping(_) => self.enter(State::Fault),
        }
    }

    /// Begins the way to a state in which the bridges are off. The motor does not move any more.
    fn disable<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, to: State) {
        if !plant.stands() {
            plant.stop_hard();
        }
        self.changes.disabled = true;
        self.release_brake(plant, false);
        self.way = Transition::Applying(plant.settings.after(plant.now, Object::BrakeApplyDelay), to);
    }

    /// Stops the motor as the quick stop option code says; the state lasts, or SWITCH ON DISABLED follows.
    fn quick_stop<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, ramp: Object, lasts: bool) {
        let slow = SLOW_DOWN.contains(&plant.settings.of(Object::QuickStopOption));
        let ramp = if slow { plant.settings.acceleration(ramp) } else { plant.quick_ramp() };
        self.enter(State::QuickStopActive);
        plant.slow_down(ramp);
        if !lasts {
            self.way = Transition::Stopping(State::SwitchOnDisabled);
        }
    }

    /// Releases the brake, or applies it.
    fn release_brake<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, released: bool) {
        self.released = released;
        plant.settings.switch_outputs(plant.device, released);
    }
}
