//! The drive of CiA 402 (manual chapters 5 to 9): states and controlword, modes of operation, limits and faults.
//!
//! A controlword comes in by [`Drive::obey`] and each millisecond's turn by [`Drive::turn`]; what the drive works with
//! is lent to it for the call, as a [`Plant`]. Each file has a part of the drive that owns what it notes. `power.rs`
//! has the state, of which `state.rs` says which command leads where. `mode.rs` has what the mode of operation asks of
//! the motor, and `homing.rs` what homing does. `limit.rs` has what keeps the motor within its limits, and `fault.rs`
//! the causes that must stop it. `encoder.rs` compares the motor with the built-in encoder. Here they are put together.

pub(super) mod encoder;
mod fault;
mod homing;
mod limit;
mod mode;
mod plant;
mod power;
mod state;
mod status;
mod task;
pub(super) mod unit;

pub(super) use plant::{Plant, Shown};
pub(super) use state::State;

use fault::{OpenLoad, causes};
use homing::Homing;
use limit::Limits;
use mode::{Motion, OperationMode};
use power::{Changes, Orders, Power};
use task::Task;

use super::bus::BusState;
use super::cia301::nmt::Nmt;
use super::errors::Emergency;
use super::object::Object;
use crate::device::Circuit;
use crate::motion::{Events, Side};

/// Bit of the controlword: a new set-point, or the start of a homing.
const START: u16 = 1 << 4;
/// Bit of the controlword: the set-point is relative.
const RELATIVE: u16 = 1 << 6;
/// Bit of the controlword: a fault reset.
const FAULT_RESET: u16 = 1 << 7;
/// Bit of the controlword: the motor halts.
const HALT: u16 = 1 << 8;

/// The drive.
#[derive(Debug, Default)]
pub(super) struct Drive {
    power: Power,
    motion: Motion,
    homing: Homing,
    limits: Limits,
    open_load: OpenLoad,
    /// The controlword that came last.
    controlword: u16,
    /// The statusword at the end of the last turn.
    shown: u32,
}

impl Drive {
    pub(super) const fn state(&self) -> State {
        self.power.state()
    }

    /// The number of the mode in force (6061h).
    pub(super) const fn mode(&self) -> u32 {
        self.motion.mode() as u32
    }

    /// The 607Ch that the last homing has used that came to its end (2100h).
    pub(super) const fn home_offset_used(&self) -> u32 {
        self.homing.offset_used()
    }

    /// True while the brake is released.
    pub(super) const fn has_released_brake(&self) -> bool {
        self.power.is_released()
    }

    /// True while the drive is on no way to another state.
    pub(super) fn is_lasting(&self) -> bool {
        self.power.is_lasting()
    }

    /// True if a homing that is under way has come to the home position.
    pub(super) const fn finds_home(&self, events: Events) -> bool {
        self.homing.finds_home(events)
    }

    /// The turn of the drive, once in each millisecond, after what is measured has been read. `events` are those of the
    /// axis since the turn before.
    pub(super) fn turn<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, events: Events) {
        self.look_for_faults(plant);
        if plant.in_tmcl_mode {
            self.look_at_statusword(plant);
            return self.progress(plant);
        }
        if let Some(side) = self.homing.follow(plant, events) {
            self.limits.meet_switch(plant, usize::from(side == Side::Right));
        }
        self.look_at_limits(plant, events);
        self.progress(plant);
        let asked = self.asked(plant);
        self.steer_to(plant, asked);
        self.motion.look_at_target(plant, asked, self.power.is_operating());
        self.look_at_statusword(plant);
    }

    /// Looks for the causes of emergencies that last for a time. The beginning of each is told, and has its reaction.
    fn look_for_faults<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        let open = self.open_load.turn(plant.live);
        let causes = causes(plant, &self.power, open);
        if plant.errors.are_noted(&causes) {
            return;
        }
        for (emergency, exists) in causes {
            if plant.report(emergency, exists) {
                self.fault(plant);
            }
        }
    }

    /// Looks at the limits.
    fn look_at_limits<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, events: Events) {
        if self.homing.is_running() {
            // A search runs to the switches, and positions have no meaning before its end.
            self.limits = Limits::default();
        } else {
            let asked = if self.power.is_operating() { self.asked(plant) } else { Task::Stand };
            self.limits.watch_ends(plant, asked);
            if events.stall {
                self.motion.drop(asked);
            }
            self.limits.watch_stall(events.stall, self.motion.has_dropped(asked));
        }
        self.limits.report_stall(plant);
    }

    /// Looks whether the statusword is another than in the turn before.
    fn look_at_statusword<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        let word = self.statusword(&plant.shown());
        *plant.touched |= core::mem::replace(&mut self.shown, word) != word;
    }

    /// Obeys a controlword: commands, fault reset, and the bits of the mode of operation.
    pub(super) fn obey<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, word: u16) {
        let before = core::mem::replace(&mut self.controlword, word);
        let operates = self.power.is_operating();
        if word & !before & FAULT_RESET != 0 {
            self.reset_fault(plant);
        }
        self.power.obey(plant, self.orders());
        self.progress(plant);
        self.operate(plant, before, operates);
        self.steer(plant);
    }

    /// Takes the bits of the controlword that belong to the mode; `before` is the controlword before, with which the
    /// drive was operating or not. An edge in the word that enables operation moves nothing, however long the way there
    /// takes.
    fn operate<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, before: u16, operates: bool) {
        let word = self.controlword;
        let starts = word & !before & START != 0;
        let ends = before & !word & START != 0;
        let operates = operates && self.power.is_operating();
        match self.motion.mode() {
            OperationMode::ProfilePosition if starts && operates => {
                self.motion.take_target(plant, word & RELATIVE != 0)
            }
            OperationMode::Homing if starts => self.homing.start(plant, operates),
            OperationMode::Homing if ends => self.homing.stop(plant),
            _ => {}
        }
        if ends {
            self.motion.end_acknowledgement();
        }
    }

    /// Changes the mode of operation. A motor that moves is stopped first.
    pub(super) fn change_mode<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, number: u32) {
        let mode = OperationMode::numbered(number);
        if self.motion.mode() == mode {
            return;
        }
        if self.power.is_operating() {
            self.homing.abort();
            plant.slow_down(plant.settings.acceleration(self.motion.ramp()));
        }
        self.motion.enter(mode);
        self.steer(plant);
    }

    /// Tells the motor what the mode asks for, if that has changed.
    pub(super) fn steer<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        let asked = self.asked(plant);
        self.steer_to(plant, asked);
    }

    fn steer_to<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, asked: Task) {
        if self.power.is_operating() {
            self.motion.steer(plant, asked);
        }
    }

    /// The task that the mode asks for.
    fn asked<T: Circuit>(&self, plant: &Plant<'_, T>) -> Task {
        self.motion.asked(plant.settings, self.controlword & HALT != 0)
    }

    /// Goes on with the way to the next state. Inlined as far as it asks whether there is one, which is asked in each
    /// turn.
    #[inline(always)]
    fn progress<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if !self.power.is_quiet() {
            self.go_on(plant);
        }
    }

    #[inline(never)]
    fn go_on<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        self.power.progress(plant, self.orders());
        let Changes { entered, disabled } = self.power.take_changes();
        if disabled {
            self.homing.abort();
        }
        if entered {
            self.motion.forget();
            *plant.touched = true;
        }
    }

    const fn orders(&self) -> Orders {
        Orders { word: self.controlword, ramp: self.motion.ramp() }
    }

    /// TMCL mode begins: the motor stops by the quick stop ramp, and the drive is SWITCH ON DISABLED.
    pub(super) fn yield_motor<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        plant.end_motion();
        self.homing.abort();
        self.limits.end(plant);
        self.power.yield_motor(plant);
        self.progress(plant);
    }

    /// A fault has come up: the motor is stopped by the quick stop ramp, and FAULT follows; but in TMCL mode there are
    /// no states.
    pub(super) fn fault<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if matches!(self.state(), State::FaultReactionActive | State::Fault) {
            return;
        }
        if plant.in_tmcl_mode {
            plant.end_motion();
        } else {
            self.homing.abort();
            self.power.react(plant);
            self.progress(plant);
        }
        if plant.settings.of(Object::ApplicationErrorBehaviour) != 1 {
            plant.stop_services();
        }
    }

    /// The master cannot command the drive any more: a motor that may move, or is about to, is stopped, and FAULT
    /// follows.
    pub(super) fn leave_master<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if self.state().is_driving() || !self.is_lasting() || plant.in_tmcl_mode {
            self.fault(plant);
        }
    }

    /// The master is not heard any more.
    pub(super) fn lose_master<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if plant.report(Emergency::MasterLost, true) {
            self.fault(plant);
        }
    }

    /// The CAN controller is off the bus: nothing can be commanded any more, so the motor stops without a ramp.
    pub(super) fn leave_bus<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if self.state().is_driving() || plant.in_tmcl_mode {
            plant.stop_hard();
        }
        self.fault(plant);
    }

    /// Resets a fault (transition 15), if all causes are gone. In other states the error register forgets what is gone.
    fn reset_fault<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if self.state() != State::Fault {
            return plant.errors.forget();
        }
        if plant.bus == BusState::Off || plant.state == Nmt::Stopped || plant.errors.holds_fault() {
            return;
        }
        plant.follow_encoder();
        self.power.enter(State::SwitchOnDisabled);
        plant.errors.forget();
        plant.errors.raise(Emergency::Reset, None);
    }
}
