//! Command 138: a host asks for an event when axes arrive at their targets (manual section 3.7.37). Only one host at a
//! time can do so; the last request counts.

use super::origin::{Due, Origin, Source};
use crate::executor::Outcome;
use crate::tmcl::{Command, Opcode, Reply, Status};

/// The request of command 138 that is in force, if there is one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arrivals {
    subscription: Option<Subscription>,
    /// Number of requests since the start, wrapping at 32 bits.
    count: u32,
}

/// A request of command 138.
#[derive(Clone, Copy, Debug)]
struct Subscription {
    /// The link to which the events go.
    origin: Origin,
    /// Axes whose next move is to end with an event, as bits.
    mask: i32,
    /// True for type 0: only the next move of each axis ends with an event.
    once: bool,
    /// Axes on a move that is to end with an event, as bits.
    armed: i32,
    /// Axes that have arrived, and whose events the link has not taken yet, as bits. So however many arrive at once,
    /// and however long the link is busy, none is forgotten.
    arrived: i32,
}

impl Arrivals {
    /// Notes that axes, axis n in bit n, have begun a positioning move or a reference search: their arrivals will be
    /// events if these were asked for.
    pub(super) fn arm(&mut self, axes: u8) {
        if let Some(subscription) = &mut self.subscription {
            subscription.armed |= subscription.mask & i32::from(axes);
            if subscription.once {
                subscription.mask &= !i32::from(axes);
            }
        }
    }

    /// Notes that the moves of axes, axis n in bit n, were replaced by another command, or stopped: no event will
    /// follow.
    pub(super) fn disarm(&mut self, axes: u8) {
        if let Some(subscription) = &mut self.subscription {
            subscription.armed &= !i32::from(axes);
        }
    }

    /// Notes that the moves of axes, axis n in bit n, have arrived: their events wait for the link, if these were asked
    /// for.
    pub(super) fn arrive(&mut self, axes: u8) {
        if let Some(subscription) = &mut self.subscription {
            subscription.arrived |= subscription.armed & i32::from(axes);
            subscription.armed &= !i32::from(axes);
        }
    }

    /// True while an event waits for its link.
    pub(super) fn wait(&self) -> bool {
        self.subscription.is_some_and(|asked| asked.arrived != 0)
    }

    /// Takes the event of the first axis of those that wait, if the link takes it.
    pub(super) fn next(&mut self, takes: impl FnOnce(Source) -> bool) -> Option<Due> {
        let Subscription { origin, arrived, .. } = self.subscription.as_mut().filter(|asked| asked.arrived != 0)?;
        if !takes(origin.source) {
            return None;
        }
        let first = *arrived & arrived.wrapping_neg();
        *arrived &= !first;
        let opcode = Opcode::PositionReachedEvent as u8;
        let event = Reply::Plain { status: Status::PositionReached, opcode, value: first };
        Some(Due { to: *origin, reply: Some(event) })
    }

    /// Forgets the request of a link.
    pub(super) fn forget(&mut self, source: Source) {
        self.subscription = self.subscription.filter(|subscription| subscription.origin.source != source);
    }

    /// The link of the host that waits for an event of command 138, with a number that changes with each request: it
    /// distinguishes the hosts that share a link. `None` while no event can follow.
    pub(super) fn subscriber(&self) -> Option<(Source, u32)> {
        let Arrivals { subscription, count } = *self;
        let waited_for = |asked: &Subscription| asked.mask | asked.armed | asked.arrived != 0;
        subscription.filter(waited_for).map(|subscription| (subscription.origin.source, count))
    }

    /// Command 138: the host is to get an event when a positioning move arrives, or a reference search has made its
    /// zero point. Bits of axes that do not exist are ignored, because published hosts set all eight. Events that this
    /// host has not been sent yet are still sent.
    pub(super) fn subscribe<const AXES: usize>(&mut self, origin: Origin, command: Command) -> Result<Outcome, Status> {
        let Command { kind, value: mask, .. } = command;
        let once = match kind {
            0 => true,
            1 => false,
            _ => return Err(Status::WrongType),
        };
        let all = 1_i32.unbounded_shl(AXES as u32).wrapping_sub(1);
        let Arrivals { subscription, count } = *self;
        let arrived = subscription.filter(|before| before.origin == origin).map_or(0, |before| before.arrived);
        let subscription = Some(Subscription { origin, mask: mask & all, once, armed: 0, arrived });
        *self = Arrivals { subscription, count: count.wrapping_add(1) };
        Ok(Outcome::Value(mask))
    }
}
