//! A CAN bus with the virtual modules and any number of adapters on it.
//!
//! Frames go one after the other at 1 Mbit/s, and those who have one to send take turns, modules before adapters. An
//! adapter waits while a module has not come to a frame before: real modules would lose it. Bit rates are not enforced:
//! what is set by global parameter 69 and at the adapters changes nothing.

use std::collections::VecDeque;

use hal_sim::clock::{MICROSECOND, Nanos};

use crate::device::Device;
use tmcm::can::{CanFrame, Frame};

/// Bits of a frame without its data, and the silence behind it: 11-bit and 29-bit identifier. Stuff bits, which depend
/// on what is in it, are left out.
const FRAME_BITS: [u64; 2] = [47, 67];

/// Who sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Node {
    /// A module, by its index.
    Module(usize),
    /// A host's adapter, by a number of the host's choice.
    Adapter(u64),
}

/// A frame that everybody on the bus has heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heard {
    /// When.
    pub at: Nanos,
    /// Who has sent it.
    pub from: Node,
    /// The frame.
    pub frame: Frame,
}

/// The bus.
#[derive(Debug, Default)]
pub(super) struct Bus {
    /// Who has sent something, and what has not been on the bus.
    senders: Vec<(Node, VecDeque<Frame>)>,
    /// Which of them is next, of the adapters.
    turn: usize,
    /// The frame that is on its way.
    wire: Option<Heard>,
    /// Until when frames have been on their way.
    taken: Nanos,
    /// For the adapters.
    pub(super) heard: VecDeque<Heard>,
}

impl Bus {
    /// A node wants a frame on the bus.
    pub(super) fn send(&mut self, from: Node, frame: Frame) {
        match self.senders.iter_mut().find(|(node, _)| *node == from) {
            Some((_, frames)) => frames.push_back(frame),
            None => self.senders.push((from, VecDeque::from([frame]))),
        }
    }

    /// A node is gone, or has lost its power: what it was going to send is not sent.
    pub(super) fn cut_off(&mut self, node: Node) {
        self.senders.retain(|(sender, _)| *sender != node);
        self.wire.take_if(|heard| heard.from == node);
    }

    /// Nobody is left who would acknowledge a frame: the adapters give up what they were going to send.
    pub(super) fn fall_silent(&mut self) {
        self.senders.clear();
        self.wire = None;
    }

    /// When the next frame is complete.
    pub(super) fn next_event(&self) -> Option<Nanos> {
        self.wire.as_ref().map(|heard| heard.at)
    }

    /// How many frames of a node have not been on the bus.
    pub(super) fn waiting(&self, node: Node) -> usize {
        let frames = self.senders.iter().find(|(sender, _)| *sender == node).map_or(0, |(_, frames)| frames.len());
        frames + usize::from(self.wire.as_ref().is_some_and(|heard| heard.from == node))
    }

    /// Hands out the frames that are complete by now.
    pub(super) fn deliver(&mut self, modules: &mut [impl Device], now: Nanos) {
        while let Some(heard) = self.wire.take_if(|heard| heard.at <= now) {
            let others = modules.iter_mut().enumerate().filter(|(index, _)| heard.from != Node::Module(*index));
            others.for_each(|(_, module)| module.receive_frame(&heard.frame));
            let at = heard.at;
            self.heard.push_back(heard);
            self.begin(modules, at);
        }
    }

    /// Lets the next frame begin if the bus is free.
    pub(super) fn begin(&mut self, modules: &[impl Device], now: Nanos) {
        if self.wire.is_some() {
            return;
        }
        let ready = modules.iter().all(|module| module.unread_frames() == 0);
        let count = self.senders.len();
        let turns = (self.turn..count).chain(0..self.turn.min(count));
        let sends = |index: &usize| self.senders.get(*index).is_some_and(|(_, frames)| !frames.is_empty());
        let is_module = |index: &usize| matches!(self.senders.get(*index), Some((Node::Module(_), _)));
        // Else replies would fall behind the requests of many adapters.
        let module = turns.clone().filter(is_module).find(sends);
        let Some(index) = module.or_else(|| turns.filter(|_| ready).find(sends)) else { return };
        let Some((from, frames)) = self.senders.get_mut(index) else { return };
        let Some(frame) = frames.pop_front() else { return };
        let data = frame.data().len() as u64;
        let bits = FRAME_BITS[usize::from(frame.is_extended())] + 8 * data;
        self.taken = self.taken.max(now) + bits * MICROSECOND;
        self.wire = Some(Heard { at: self.taken, from: *from, frame });
        if module.is_none() {
            self.turn = index + 1;
        }
    }
}
