//! When hosts were heard last: one that falls silent for too long (global parameters 68 and 82) has its motors stopped.

use super::Source;
use crate::param::GlobalParameter as G;
use crate::units::Micros;

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
    /// Inlined, because each command asks.
    #[inline(always)]
    pub(super) fn heartbeat_missed(&self, now: Micros, serial_limit: i32, can_limit: i32) -> bool {
        serial_limit | can_limit != 0 && self.is_over(now, serial_limit, can_limit)
    }

    /// A function of its own, because most modules have no limit.
    #[inline(never)]
    fn is_over(&self, now: Micros, serial_limit: i32, can_limit: i32) -> bool {
        let over =
            |heard, limit: i32| limit != 0 && now.since(heard) > Micros::from_millis(limit.unsigned_abs().into());
        over(self.serial, serial_limit) || over(self.can, can_limit)
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
