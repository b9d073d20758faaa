//! What stops the motors from outside: a host that falls silent (global parameters 68 and 82) and a supply
//! that is too low (manual section 12.1, firmware 1.35).

use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;

use super::{Hooks, Module, Source};
use crate::param::GlobalParameter as G;
use crate::units::Micros;
use crate::vm::ErrorFlag;

/// Below this supply voltage, in 0.1 V, the motors are stopped and locked.
const LOCK: u16 = 85;
/// Above this one they are released.
const RELEASE: u16 = 95;

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

/// Kinds of links with a heartbeat of their own.
const HEARTBEATS: usize = 2;

/// Which heartbeat a link keeps up: RS485 and USB share parameter 68.
fn heartbeat(source: Source) -> usize {
    match source {
        Source::Usb | Source::Rs485 => 0,
        Source::Can { .. } => 1,
    }
}

/// When each kind of link was last heard, and whether the motors are locked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supervision {
    heard: [Micros; HEARTBEATS],
    silent: [bool; HEARTBEATS],
    locked: bool,
}

impl Supervision {
    pub(super) const fn new(now: Micros) -> Self {
        Supervision { heard: [now; HEARTBEATS], silent: [false; HEARTBEATS], locked: false }
    }

    /// A command has come in.
    pub(super) fn hear(&mut self, now: Micros, source: Source) {
        let kind = heartbeat(source);
        if let (Some(heard), Some(silent)) = (self.heard.get_mut(kind), self.silent.get_mut(kind)) {
            *heard = now;
            *silent = false;
        }
    }

    /// True when a link has just fallen silent for longer than its limit, in milliseconds; 0 is no limit.
    /// A silence is told of once.
    pub(super) fn silence(&mut self, now: Micros, limits: [i32; HEARTBEATS]) -> bool {
        let mut fallen = false;
        for ((heard, silent), limit) in self.heard.iter().zip(&mut self.silent).zip(limits) {
            let limit = Micros::from_millis(limit.unsigned_abs().into());
            if limit != Micros(0) && !*silent && now.since(*heard) > limit {
                *silent = true;
                fallen = true;
            }
        }
        fallen
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

    /// True while the supply is too low for motion.
    pub(super) const fn locked(&self) -> bool {
        self.locked
    }
}

impl<M: SpiDevice, D: SpiDevice, E: OutputPin, H: Hooks, const AXES: usize> Module<M, D, E, H, AXES> {
    /// Stops the motors where a host has fallen silent, and with the program where the supply is too low.
    pub(super) fn supervise(&mut self, now: Micros) {
        let limits = [self.global(G::SerialHeartbeat), self.global(G::CanHeartbeat)];
        if self.supervision.silence(now, limits) {
            self.interrupt(now, |axis, chip| axis.rotate(now, chip, 0));
        }
        match self.supervision.supply(self.inputs.supply) {
            Supply::Lost => {
                self.machine.stop();
                self.interrupt(now, |axis, chip| axis.hard_stop(now, chip));
            }
            Supply::Restored => {
                self.interrupt(now, |axis, _| axis.restart_driver());
                self.starts = true;
            }
            Supply::Steady => {}
        }
        if self.supervision.locked() {
            self.machine.errors.raise(ErrorFlag::Shutdown);
        }
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
    fn a_silence_is_told_of_once() {
        let mut supervision = Supervision::new(Micros(0));
        let at = Micros::from_millis;
        assert!(!supervision.silence(at(100_000), [0, 0]));
        supervision.hear(at(1_000), Source::Usb);
        assert!(!supervision.silence(at(1_100), [100, 0]));
        assert!(supervision.silence(at(1_101), [100, 0]));
        assert!(!supervision.silence(at(1_102), [100, 0]));
        supervision.hear(at(1_200), Source::Rs485);
        assert!(supervision.silence(at(1_301), [100, 0]));
    }
}
