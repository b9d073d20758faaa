//! Error control: the boot-up message and the heartbeat of this node, the answers to node guarding, and the watch over
//! the master by its heartbeat or its guarding.

use super::nmt::Nmt;
use crate::units::Micros;

/// The byte of a boot-up message.
const BOOT_UP: u8 = 0;

/// Error control of a node.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Control {
    /// The byte of a message that is to be sent.
    message: Option<u8>,
    heartbeat: Heartbeat,
    guarded: Guarded,
    /// The watch over the master by its guarding, and by its heartbeat.
    guarding: Watch,
    master: Watch,
}

/// The times of error control, each 0 for none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Times {
    /// The period of this node's heartbeat (1017h).
    pub(crate) heartbeat: Micros,
    /// How long the heartbeat of the master may be missing (1016h).
    pub(crate) master: Micros,
    /// How long its guarding may be missing (100Ch and 100Dh).
    pub(crate) life: Micros,
}

impl Control {
    /// The node boots up at `now`; its heartbeats follow with this period, 0 for none. Nothing has been heard of the
    /// master.
    pub(super) fn begin(now: Micros, period: Micros) -> Self {
        Control { message: Some(BOOT_UP), heartbeat: Heartbeat::begin(now, period), ..Control::default() }
    }

    /// The period of the heartbeat has been written: the next one comes with the next turn.
    pub(crate) fn restart_heartbeat(&mut self) {
        self.heartbeat = Heartbeat::default();
    }

    /// Watches over the guarding of the master anew, from the next time on.
    pub(crate) fn restart_guarding(&mut self) {
        self.guarding = Watch::default();
    }

    /// Watches over the heartbeat of the master anew, from the next one on.
    pub(crate) fn restart_master(&mut self) {
        self.master = Watch::default();
    }

    /// A master guards this node: it is told the state.
    pub(crate) fn guard(&mut self, now: Micros, state: Nmt) {
        self.guarding.hear(now);
        // A message that has not been sent, such as the boot-up, goes first; then this question has no answer.
        if self.message.is_none() {
            self.message = Some(self.guarded.answer(state as u8));
        }
    }

    /// The master that is watched has sent a message of error control. A boot-up message is no heartbeat: a master that
    /// starts may not have set up its own yet.
    pub(crate) fn hear(&mut self, now: Micros, data: &[u8]) {
        if data != [BOOT_UP] {
            self.master.hear(now);
        }
    }

    /// To be called in each turn: true when the master has been lost since the last one.
    pub(crate) fn turn(&mut self, now: Micros, state: Nmt, times: Times) -> bool {
        let period = times.heartbeat;
        if period > Micros(0) && self.heartbeat.is_due(now, period) && self.message.is_none() {
            self.message = Some(state as u8);
        }
        let lost = self.master.has_lost(now, times.master);
        self.guarding.has_lost(now, times.life) || lost
    }

    /// True if the master has not been heard since it was lost.
    pub(crate) const fn has_lost_master(&self) -> bool {
        self.master.is_lost() || self.guarding.is_lost()
    }

    /// True while the boot-up message is still to be sent.
    pub(crate) fn boots(&self) -> bool {
        self.message == Some(BOOT_UP)
    }

    /// The byte of the next message.
    pub(crate) const fn next(&mut self) -> Option<u8> {
        self.message.take()
    }
}

/// Watches that something is heard again and again, from the first time on.
#[derive(Clone, Copy, Debug, Default)]
struct Watch {
    heard: Option<Micros>,
    lost: bool,
}

impl Watch {
    /// Notes that it was heard at `now`.
    const fn hear(&mut self, now: Micros) {
        (self.heard, self.lost) = (Some(now), false);
    }

    /// True if it has not been heard since it was lost.
    const fn is_lost(&self) -> bool {
        self.lost
    }

    /// True, once, when it has not been heard for `limit`; a limit of 0 is none. Then the watch begins anew when it is
    /// heard again.
    fn has_lost(&mut self, now: Micros, limit: Micros) -> bool {
        let lost = limit > Micros(0) && self.heard.is_some_and(|heard| now.since(heard) >= limit);
        if lost {
            (self.heard, self.lost) = (None, true);
        }
        lost
    }
}

/// The producer of this node's heartbeat.
#[derive(Clone, Copy, Debug, Default)]
struct Heartbeat {
    /// When the next heartbeat is due; `None` for the next turn.
    next: Option<Micros>,
}

impl Heartbeat {
    /// The heartbeat begins at `now`, after a boot-up message, which counts as the first.
    const fn begin(now: Micros, period: Micros) -> Self {
        Heartbeat { next: Some(now.after(period)) }
    }

    /// True if a heartbeat is to be sent now; the period is not 0. A heartbeat that is late does not delay the ones
    /// after it.
    fn is_due(&mut self, now: Micros, period: Micros) -> bool {
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
struct Guarded {
    toggle: bool,
}

impl Guarded {
    /// The byte that answers a remote frame of the master: the state, and a bit that changes each time.
    const fn answer(&mut self, state: u8) -> u8 {
        let toggle = self.toggle;
        self.toggle = !toggle;
        state | (toggle as u8) << 7
    }
}
