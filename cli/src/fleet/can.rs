//! A CAN bus with the virtual modules and any number of adapters on it.
//!
//! Frames go one after the other, in the order in which they were sent, at 1 Mbit/s. Bit rates are not enforced:
//! what is set by global parameter 69 and at the adapters changes nothing.

use std::collections::VecDeque;

use hal_sim::clock::{MICROSECOND, Nanos};

use crate::device::Device;
use crate::slcan::CanFrame;

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
    pub frame: CanFrame,
}

/// The bus.
#[derive(Debug, Default)]
pub(super) struct Bus {
    wire: VecDeque<Heard>,
    /// Until when frames are on their way.
    taken: Nanos,
    /// For the adapters.
    pub(super) heard: VecDeque<Heard>,
}

impl Bus {
    /// A node wants a frame on the bus.
    pub(super) fn send(&mut self, now: Nanos, from: Node, frame: CanFrame) {
        let data = frame.data.as_ref().map_or(0, |data| data.len() as u64);
        let bits = FRAME_BITS[usize::from(frame.extended)] + 8 * data;
        self.taken = self.taken.max(now) + bits * MICROSECOND;
        self.wire.push_back(Heard { at: self.taken, from, frame });
    }

    /// A module has lost its power: what it was going to send is not sent.
    pub(super) fn cut_off(&mut self, module: usize) {
        self.wire.retain(|heard| heard.from != Node::Module(module));
    }

    /// When the next frame is complete.
    pub(super) fn next_event(&self) -> Option<Nanos> {
        self.wire.front().map(|heard| heard.at)
    }

    /// How many frames are on their way.
    pub(super) fn waiting(&self) -> usize {
        self.wire.len()
    }

    /// Hands out the frames that are complete by now.
    pub(super) fn deliver(&mut self, modules: &mut [impl Device], now: Nanos) {
        while let Some(heard) = self.wire.pop_front_if(|heard| heard.at <= now) {
            let others = modules.iter_mut().enumerate().filter(|(index, _)| heard.from != Node::Module(*index));
            others.for_each(|(_, module)| module.receive_frame(&heard.frame));
            self.heard.push_back(heard);
        }
    }
}
