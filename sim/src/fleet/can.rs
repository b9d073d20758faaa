//! The virtual CAN bus of a fleet: the modules and any number of hosts' adapters.
//!
//! Frames follow each other at 1 Mbit/s. Modules send before adapters, and nodes of the same kind take turns. An
//! adapter waits while any module has an unread frame, which a real module might lose. The bit rates set by global
//! parameter 69 and at the adapters have no effect.

use std::collections::VecDeque;

use hal_sim::clock::{MICROSECOND, Nanos};

use crate::module::VirtualModule;
use tmcm::can::{CanFrame, Frame};

/// Bits of a frame without its data, with the pause behind the frame: 11-bit and 29-bit identifier. Stuff bits are left
/// out, because their number depends on the frame's contents.
const FRAME_BITS: [u64; 2] = [47, 67];

/// A sender on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Node {
    /// A module, by its index.
    Module(usize),
    /// A host's adapter, by a number of the host's choice.
    Adapter(u64),
}

/// A frame that all nodes on the bus have received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heard {
    /// When the frame was complete, in virtual time.
    pub at: Nanos,
    /// The node that has sent the frame.
    pub from: Node,
    /// The frame.
    pub frame: Frame,
}

/// The CAN bus.
#[derive(Debug, Default)]
pub(super) struct Bus {
    /// Nodes that have ever sent, each with its frames that have not begun yet.
    senders: Vec<(Node, VecDeque<Frame>)>,
    /// Index in `senders` from which the next adapter to send is searched.
    turn: usize,
    /// The frame that is being transmitted, with the time at which it will be complete.
    wire: Option<Heard>,
    /// When the last frame that has begun is complete.
    busy_until: Nanos,
    /// Complete frames that the adapters have not taken yet.
    pub(super) heard: VecDeque<Heard>,
}

impl Bus {
    /// Queues a frame of a node.
    pub(super) fn send(&mut self, from: Node, frame: Frame) {
        match self.senders.iter_mut().find(|(node, _)| *node == from) {
            Some((_, frames)) => frames.push_back(frame),
            None => self.senders.push((from, VecDeque::from([frame]))),
        }
    }

    /// Drops the frames of a node that has left the bus or lost its power.
    pub(super) fn cut_off(&mut self, node: Node) {
        self.senders.retain(|(sender, _)| *sender != node);
        self.wire.take_if(|heard| heard.from == node);
    }

    /// Drops all frames, because no module has power to acknowledge a frame.
    pub(super) fn discard_all(&mut self) {
        self.senders.clear();
        self.wire = None;
    }

    /// When the frame that is being transmitted will be complete.
    pub(super) fn next_event(&self) -> Option<Nanos> {
        self.wire.as_ref().map(|heard| heard.at)
    }

    /// True while any frame waits or is being transmitted.
    pub(super) fn is_in_use(&self) -> bool {
        self.wire.is_some() || self.senders.iter().any(|(_, frames)| !frames.is_empty())
    }

    /// Number of a node's frames that are not complete yet.
    pub(super) fn waiting(&self, node: Node) -> usize {
        let frames = self.senders.iter().find(|(sender, _)| *sender == node).map_or(0, |(_, frames)| frames.len());
        frames + usize::from(self.wire.as_ref().is_some_and(|heard| heard.from == node))
    }

    /// Gives the modules and adapters the frames that are complete by now.
    pub(super) fn deliver(&mut self, modules: &mut [impl VirtualModule], now: Nanos) {
        while let Some(heard) = self.wire.take_if(|heard| heard.at <= now) {
            let others = modules.iter_mut().enumerate().filter(|(index, _)| heard.from != Node::Module(*index));
            others.for_each(|(_, module)| module.receive_frame(&heard.frame));
            let at = heard.at;
            self.heard.push_back(heard);
            self.begin(modules, at);
        }
    }

    /// Lets the next frame begin if the bus is free.
    pub(super) fn begin(&mut self, modules: &[impl VirtualModule], now: Nanos) {
        if self.wire.is_some() {
            return;
        }
        let ready = modules.iter().all(|module| module.unread_frames() == 0);
        let count = self.senders.len();
        let turns = (self.turn..count).chain(0..self.turn.min(count));
        let sends = |index: &usize| self.senders.get(*index).is_some_and(|(_, frames)| !frames.is_empty());
        let is_module = |index: &usize| matches!(self.senders.get(*index), Some((Node::Module(_), _)));
        // Modules go first, so that replies do not fall behind the requests of many adapters.
        let module = turns.clone().filter(is_module).find(sends);
        let Some(index) = module.or_else(|| turns.filter(|_| ready).find(sends)) else { return };
        let Some((from, frames)) = self.senders.get_mut(index) else { return };
        let Some(frame) = frames.pop_front() else { return };
        let data = frame.data().len() as u64;
        let bits = FRAME_BITS[usize::from(frame.is_extended())] + 8 * data;
        self.busy_until = self.busy_until.max(now) + bits * MICROSECOND;
        self.wire = Some(Heard { at: self.busy_until, from: *from, frame });
        if module.is_none() {
            self.turn = index + 1;
        }
    }
}
