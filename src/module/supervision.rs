//! The supervision of hosts, supply and motion controllers. A host that falls silent (global parameters 68 and 82) has
//! the motors stopped here. For a supply that is too low or a silent motion controller the device has stopped them
//! already; here the program is stopped and the error flags are raised.

use super::{Module, Platform, Source};
use crate::device::{Supervised, Supply};
use crate::param::{AxisParameter as P, GlobalParameter as G};
use crate::units::Micros;
use crate::vm::ErrorFlag;

/// The time at which each kind of link last brought a command.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supervision {
    /// RS485 and USB, which share global parameter 68.
    serial: Micros,
    /// CAN, which has global parameter 82.
    can: Micros,
}

impl Supervision {
    /// The time limits of all links count from `now`.
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

    /// Notes that a global parameter has been written: if it is a time limit, it counts from now on.
    pub(super) fn limit(&mut self, now: Micros, parameter: G) {
        match parameter {
            G::SerialHeartbeat => self.serial = now,
            G::CanHeartbeat => self.can = now,
            _ => {}
        }
    }

    /// The time before which no host misses its heartbeat, if none is heard. It is in the past if a host has missed it.
    pub(super) fn calm_until(&self, serial_limit: i32, can_limit: i32) -> Micros {
        let end = |heard: Micros, limit: i32| match limit {
            0 => Micros(u64::MAX),
            limit => heard.after(Micros::from_millis(limit.unsigned_abs().into())),
        };
        end(self.serial, serial_limit).min(end(self.can, can_limit))
    }

    /// True while a kind of link has brought no command for longer than its limit, in milliseconds; a limit of 0 is
    /// none.
    fn heartbeat_missed(&self, now: Micros, serial_limit: i32, can_limit: i32) -> bool {
        let over =
            |heard, limit: i32| limit != 0 && now.since(heard) > Micros::from_millis(limit.unsigned_abs().into());
        over(self.serial, serial_limit) || over(self.can, can_limit)
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Stops the motors along the ramp when a host misses its heartbeat; until a host is heard again no motor can be
    /// started. Where the device has stopped the motors in this turn, stops the program, too.
    pub(super) fn supervise(&mut self, now: Micros, supervised: Supervised) {
        let Supervised { supply, silent, resumed, ended } = supervised;
        self.note_ended(ended);
        if silent || supply == Supply::Lost {
            self.machine.stop();
        }
        if supply == Supply::Restored {
            self.starts = true;
        }
        if resumed {
            self.device.enable_drivers(true);
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

    /// Notes that all axes have been stopped, if `ended` is not `None`. Its bits are the axes that were on a
    /// positioning move.
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

    /// True if a motor is on a move, or turns, or if its motion controller does not answer.
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
