//! What stops the motors from outside: a host that falls silent (global parameters 68 and 82), a supply that is too
//! low (manual section 12.1, firmware 1.35), and a motion controller that does not answer: who cannot be heard cannot
//! be told to stop, so its drivers are switched off, until the module is started anew.

use embedded_hal::digital::OutputPin;

use super::{Axis, Chips, Module, Platform, Source};
use crate::motion::Hardware;
use crate::param::{AxisParameter as P, GlobalParameter as G};
use crate::units::Micros;
use crate::vm::ErrorFlag;

/// Below this supply voltage, in 0.1 V, the motors are stopped and locked.
const LOCK: u16 = 85;
/// Above this one they are released.
const RELEASE: u16 = 95;

/// Polls in a row, a millisecond each, in which the motion controller does not answer before it is given up, and how
/// often it is tried at the start: a disturbance is shorter.
pub(super) const PATIENCE: u8 = 3;

/// What a look at the supply leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Supply {
    /// Nothing new.
    Steady,
    /// It has become too low.
    Lost,
    /// It is back.
    Restored,
}

/// When each kind of link was last heard, and whether the motors are locked, or given up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supervision {
    /// RS485 and USB share parameter 68.
    serial: Micros,
    can: Micros,
    locked: bool,
    /// Polls in a row in which the motion controller has not answered; [`PATIENCE`] is for good.
    unanswered: u8,
}

impl Supervision {
    pub(super) const fn new(now: Micros) -> Self {
        Supervision { serial: now, can: now, locked: false, unanswered: 0 }
    }

    /// A command has come in.
    pub(super) fn hear(&mut self, now: Micros, source: Source) {
        match source {
            Source::Usb | Source::Rs485 => self.serial = now,
            Source::Can => self.can = now,
        }
    }

    /// A parameter has been written: a limit counts from then on.
    pub(super) fn limit(&mut self, now: Micros, parameter: G) {
        match parameter {
            G::SerialHeartbeat => self.serial = now,
            G::CanHeartbeat => self.can = now,
            _ => {}
        }
    }

    /// True while nothing has been heard on a link for longer than its limit, in milliseconds; 0 is no limit.
    fn heartbeat_missed(&self, now: Micros, serial_limit: i32, can_limit: i32) -> bool {
        let over =
            |heard, limit: i32| limit != 0 && now.since(heard) > Micros::from_millis(limit.unsigned_abs().into());
        over(self.serial, serial_limit) || over(self.can, can_limit)
    }

    /// Takes the supply voltage in 0.1 V, if it is measured.
    pub(super) fn supply(&mut self, voltage: Option<u16>) -> Supply {
        match voltage {
            Some(..LOCK) if !self.locked => {
                self.locked = true;
                Supply::Lost
            }
            Some(voltage) if self.locked && voltage > RELEASE => {
                self.locked = false;
                Supply::Restored
            }
            _ => Supply::Steady,
        }
    }

    /// True while the motors must not move: the supply is too low, or the motion controller is given up.
    pub(super) const fn locked(&self) -> bool {
        self.locked || self.given_up()
    }

    const fn given_up(&self) -> bool {
        self.unanswered >= PATIENCE
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Stops the motors when a host misses its heartbeat - until it is heard again they cannot be started -, and with
    /// the program where the supply is too low or the motion controller does not answer.
    pub(super) fn supervise(&mut self, now: Micros) {
        self.listen();
        if self.heartbeat_missed(now) && self.under_way() {
            self.end_moves(|axis| axis.rotate(now, 0));
        }
        match self.supervision.supply(self.inputs.supply) {
            Supply::Lost => {
                self.machine.stop();
                self.end_moves(|axis| axis.hard_stop());
            }
            Supply::Restored => {
                self.end_moves(|axis| axis.restart_driver());
                self.starts = true;
            }
            Supply::Steady => {}
        }
        if self.supervision.locked {
            self.machine.errors.raise(ErrorFlag::Shutdown);
        }
        if self.supervision.given_up() {
            self.machine.errors.raise(ErrorFlag::Alarm);
        }
    }

    /// Gives the motion controller up if it does not answer.
    fn listen(&mut self) {
        let answers = Chips::<T>::answers(&mut self.controller);
        if self.supervision.given_up() {
            // Should it be back, it hears now that it has to stop.
            return;
        }
        self.supervision.unanswered = if answers { 0 } else { self.supervision.unanswered.saturating_add(1) };
        if self.supervision.given_up() {
            self.give_up();
            self.machine.stop();
            self.end_moves(|axis| axis.hard_stop());
        }
    }

    /// Switches the drivers off for good.
    pub(super) fn give_up(&mut self) {
        self.supervision.unanswered = PATIENCE;
        // An output pin of a microcontroller cannot fail.
        let _ = self.enable.set_high();
        self.outputs.trouble = true;
    }

    /// True while a host has not been heard for longer than parameters 68 and 82 allow.
    pub(super) fn heartbeat_missed(&self, now: Micros) -> bool {
        self.supervision.heartbeat_missed(now, self.global(G::SerialHeartbeat), self.global(G::CanHeartbeat))
    }

    /// Whether a motor is to go somewhere, or does not answer.
    fn under_way(&mut self) -> bool {
        let Module { axes, controller, .. } = self;
        let mut rests =
            |axis: &mut Axis<T>| !axis.travelling() && matches!(axis.on(controller).read(P::TargetSpeed), Ok(0));
        !axes.iter_mut().all(&mut rests)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lock_has_a_hysteresis_of_one_volt() {
        let mut supervision = Supervision::new(Micros(0));
        let look = |s: &mut Supervision, volts: u16| s.supply(Some(volts));
        assert_eq!(look(&mut supervision, 85), Supply::Steady);
        assert_eq!(look(&mut supervision, 84), Supply::Lost);
        assert_eq!(look(&mut supervision, 84), Supply::Steady);
        assert_eq!(look(&mut supervision, 95), Supply::Steady);
        assert!(supervision.locked());
        assert_eq!(look(&mut supervision, 96), Supply::Restored);
        assert_eq!(supervision.supply(None), Supply::Steady);
        assert!(!supervision.locked());
    }

    #[test]
    fn each_kind_of_link_has_a_limit() {
        let mut supervision = Supervision::new(Micros(0));
        let at = Micros::from_millis;
        assert!(!supervision.heartbeat_missed(at(100_000), 0, 0));
        supervision.hear(at(1_000), Source::Usb);
        assert!(!supervision.heartbeat_missed(at(1_100), 100, 0));
        assert!(supervision.heartbeat_missed(at(1_101), 100, 0) && supervision.heartbeat_missed(at(1_100), 100, 100));
        supervision.hear(at(1_200), Source::Rs485);
        assert!(!supervision.heartbeat_missed(at(1_300), 100, 0));
        supervision.limit(at(1_300), G::CanHeartbeat);
        supervision.hear(at(1_310), Source::Can);
        assert!(!supervision.heartbeat_missed(at(1_410), 0, 100) && supervision.heartbeat_missed(at(1_411), 0, 100));
    }
}
