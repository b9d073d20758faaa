//! Command 138: a host asks to be told when axes arrive (manual section 3.7.37).

use super::origin::{Due, Origin, Source};
use super::outcome::Outcome;
use super::{Module, Platform};
use crate::tmcl::{Command, Opcode, Reply, Status};

/// The bit of an axis in the value of command 138 and in its event.
fn bit(axis: u8) -> i32 {
    1_i32.unbounded_shl(axis.into())
}

/// The request of command 138 that is in force, if there is one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arrivals {
    subscription: Option<Subscription>,
    /// Number of requests so far, wrapping.
    count: u32,
}

#[derive(Clone, Copy, Debug)]
struct Subscription {
    /// The link that the events go to.
    origin: Origin,
    /// Axes whose next move shall be told of, as bits.
    mask: i32,
    /// True for type 0: only the next move of each axis is told of.
    once: bool,
    /// Axes on a move whose end will be told, as bits.
    armed: i32,
}

impl Arrivals {
    /// The end of the move, or search, of an axis that has just begun will be told, if it was asked for.
    pub(super) fn arm(&mut self, axis: u8) {
        if let Some(subscription) = &mut self.subscription {
            subscription.armed |= subscription.mask & bit(axis);
            if subscription.once {
                subscription.mask &= !bit(axis);
            }
        }
    }

    /// The move of an axis has given way to another command, or was stopped: it will not arrive.
    pub(super) fn disarm(&mut self, axis: u8) {
        if let Some(subscription) = &mut self.subscription {
            subscription.armed &= !bit(axis);
        }
    }

    /// The move of an axis has arrived: the event, if somebody waits for it.
    pub(super) fn arrive(&mut self, axis: u8) -> Option<Due> {
        let Subscription { origin, armed, .. } = self.subscription?;
        self.disarm(axis);
        let opcode = Opcode::PositionReachedEvent as u8;
        let event = Reply::Plain { status: Status::PositionReached, opcode, value: bit(axis) };
        (armed & bit(axis) != 0).then_some(Due { to: origin, reply: Some(event) })
    }

    /// Forgets what a link has asked for.
    pub(super) fn forget(&mut self, source: Source) {
        self.subscription = self.subscription.filter(|subscription| subscription.origin.source != source);
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// The link on which somebody waits for the event of command 138, if somebody does. The number is another one
    /// after each such command that was carried out: it tells those apart who share a link.
    pub fn subscriber(&self) -> Option<(Source, u32)> {
        let Arrivals { subscription, count } = self.arrivals;
        let waited_for = |subscription: &Subscription| subscription.mask | subscription.armed != 0;
        subscription.filter(waited_for).map(|subscription| (subscription.origin.source, count))
    }

    /// Command 138: asks for a reply when a positioning move arrives, or a reference search has found its place. Bits of
    /// axes that do not exist are ignored: published hosts set all eight.
    pub(super) fn subscribe(&mut self, origin: Origin, command: Command) -> Result<Outcome, Status> {
        let Command { kind, value: mask, .. } = command;
        let once = match kind {
            0 => true,
            1 => false,
            _ => return Err(Status::WrongType),
        };
        let all = bit(AXES as u8).wrapping_sub(1);
        let count = self.arrivals.count.wrapping_add(1);
        self.arrivals =
            Arrivals { subscription: Some(Subscription { origin, mask: mask & all, once, armed: 0 }), count };
        Ok(Outcome::Value(mask))
    }
}
