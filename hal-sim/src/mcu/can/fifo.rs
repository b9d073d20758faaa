//! A receive FIFO: three frames, and registers that show the first one (RM0090 32.7.3).

use std::collections::VecDeque;

use super::frame::CanFrame;

/// Bits of its state register: it is full, a frame came when it was, the first frame is released.
pub(super) const FULL: u32 = 1 << 3;
pub(super) const FOVR: u32 = 1 << 4;
pub(super) const RFOM: u32 = 1 << 5;
/// How many frames it takes.
const DEPTH: usize = 3;

/// A receive FIFO.
#[derive(Debug, Default)]
pub(super) struct Fifo {
    /// Frames with the high half of their registers RDTxR: time stamp and filter.
    frames: VecDeque<(CanFrame, u32)>,
    overrun: bool,
}

impl Fifo {
    /// Takes a frame. When it is full, the frame takes the place of the last one, or is lost if the FIFO is `locked`.
    pub(super) fn push(&mut self, frame: CanFrame, origin: u32, locked: bool) {
        if self.frames.len() == DEPTH {
            self.overrun = true;
            if locked {
                return;
            }
            self.frames.pop_back();
        }
        self.frames.push_back((frame, origin));
    }

    /// The registers of the first frame: RIxR, RDTxR, RDLxR, RDHxR; zero where there is none.
    pub(super) fn first(&self) -> [u32; 4] {
        self.frames.front().map_or([0; 4], |(frame, origin)| {
            let [low, high] = frame.words();
            [frame.identifier(), u32::from(frame.length) | origin, low, high]
        })
    }

    /// The state register: how many frames there are in the lowest bits.
    pub(super) fn state(&self) -> u32 {
        let pending = self.frames.len();
        let full = if pending == DEPTH { FULL } else { 0 };
        let overrun = if self.overrun { FOVR } else { 0 };
        pending as u32 | full | overrun
    }

    /// The state register is written.
    pub(super) fn write(&mut self, value: u32) {
        if value & FOVR != 0 {
            self.overrun = false;
        }
        if value & RFOM != 0 {
            self.frames.pop_front();
        }
    }
}
