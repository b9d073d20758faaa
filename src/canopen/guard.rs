//! Error control: the heartbeat of this node, the answers to node guarding, and the watch over the master by its
//! heartbeat or its guarding.

use crate::units::Micros;

/// Watches that something is heard again and again, from the first time on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watch {
    heard: Option<Micros>,
    lost: bool,
}

impl Watch {
    /// It was heard at `now`.
    pub(super) const fn hear(&mut self, now: Micros) {
        (self.heard, self.lost) = (Some(now), false);
    }

    /// True if it has not been heard since it was lost.
    pub(super) const fn is_lost(&self) -> bool {
        self.lost
    }

    /// True, once, when it has not been heard for `limit`; a limit of 0 is none. Then the watch begins anew when it is
    /// heard again.
    pub(super) fn has_lost(&mut self, now: Micros, limit: Micros) -> bool {
        let lost = limit > Micros(0) && self.heard.is_some_and(|heard| now.since(heard) >= limit);
        if lost {
            (self.heard, self.lost) = (None, true);
        }
        lost
    }
}

/// The producer of this node's heartbeat.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Heartbeat {
    /// When the next heartbeat is due; `None` for the next turn.
    next: Option<Micros>,
}

impl Heartbeat {
    /// The heartbeat begins at `now`, after a boot-up message, which counts as the first.
    pub(super) const fn begin(now: Micros, period: Micros) -> Self {
        Heartbeat { next: Some(now.after(period)) }
    }

    /// True if a heartbeat is to be sent now; the period is not 0. A heartbeat that is late does not delay the ones
    /// after it.
    pub(super) fn is_due(&mut self, now: Micros, period: Micros) -> bool {
        let due = self.next.unwrap_or(now);
        if now < due {
            return false;
        }
        let next = due.after(period);
        self.next = Some(if next > now { next } else { now.after(period) });
        true
    }
}

/// The answers to node guarding.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Guarded {
    toggle: bool,
}

impl Guarded {
    /// The byte that answers a remote frame of the master: the state, and a bit that changes each time.
    pub(super) const fn answer(&mut self, state: u8) -> u8 {
        let toggle = self.toggle;
        self.toggle = !toggle;
        state | (toggle as u8) << 7
    }
}
