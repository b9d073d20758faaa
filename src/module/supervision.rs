//! What stops the motors from outside: a host that falls silent (global parameters 68 and 82) does so here; a supply that
//! is too low and a motion controller that does not answer have stopped them in the device already, and here they stop
//! the program and are noted.

use super::{Module, Platform, Source};
use crate::device::{Supervised, Supply};
use crate::param::{AxisParameter as P, GlobalParameter as G};
use crate::units::Micros;
use crate::vm::ErrorFlag;

/// The time at which each kind of link was last heard.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supervision {
    /// RS485 and USB, which share parameter 68.
    serial: Micros,
    can: Micros,
}

impl Supervision {
    pub(super) const fn new(now: Micros) -> Self {
        Supervision { serial: now, can: now }
    }

    /// Notes that a command has come in over a link.
    pub(super) fn hear(&mut self, now: Micros, source: Source) {
        match source {
            Source::Usb | Source::Rs485 => self.serial = now,
            Source::Can => self.can = now,
        }
    }

    /// Notes that a global parameter has been written: the time limit of a heartbeat counts from then on.
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
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Stops the motors when a host misses its heartbeat: until the host is heard again they cannot be started. Where the
    /// device has stopped them, the program stops, too.
    pub(super) fn supervise(&mut self, now: Micros, supervised: Supervised) {
        let Supervised { supply, silent, ended } = supervised;
        self.note_ended(ended);
        if silent || supply == Supply::Lost {
            self.machine.stop();
        }
        if supply == Supply::Restored {
            self.starts = true;
        }
        if self.heartbeat_missed(now) && self.is_under_way() {
            let ended = self.device.end_moves(|axis| axis.rotate(now, 0));
            self.note_ended(Some(ended));
        }
        if self.device.lacks_supply() {
            self.machine.errors.raise(ErrorFlag::Shutdown);
        }
        if self.device.is_given_up() {
            self.machine.errors.raise(ErrorFlag::Alarm);
        }
    }

    /// Notes that all axes have been stopped; those of these bits were on a positioning move.
    fn note_ended(&mut self, ended: Option<u32>) {
        let Some(moving) = ended else { return };
        if moving != 0 {
            self.machine.errors.raise(ErrorFlag::Position);
        }
        for axis in 0..AXES as u8 {
            self.arrivals.disarm(axis);
        }
    }

    /// True while a host has not been heard for longer than parameters 68 and 82 allow.
    pub(super) fn heartbeat_missed(&self, now: Micros) -> bool {
        self.supervision.heartbeat_missed(now, self.global(G::SerialHeartbeat), self.global(G::CanHeartbeat))
    }

    /// True if a motor is on a move or turns, or its motion controller does not say.
    fn is_under_way(&mut self) -> bool {
        (0..AXES).any(|number| {
            let Some(mut axis) = self.device.axis(number) else { return false };
            axis.travelling() || !matches!(axis.read(P::TargetSpeed), Ok(0))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
