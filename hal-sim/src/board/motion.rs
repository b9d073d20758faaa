//! The chips that move the motors of a board: one set or another.

use super::chips::MotionChips;
use super::kind::Chip;
use super::tmc429_tmc262::Tmc429sTmc262s;
use super::tmc5160::Tmc5160s;
use crate::chip::SpiSlave;
use crate::clock::Nanos;

/// The chips of a board.
#[derive(Debug)]
pub(super) enum Motion {
    Tmc429sTmc262s(Tmc429sTmc262s),
    Tmc5160s(Tmc5160s),
}

impl Motion {
    #[inline]
    pub(super) fn chips(&self) -> &dyn MotionChips {
        match self {
            Self::Tmc429sTmc262s(chips) => chips,
            Self::Tmc5160s(chips) => chips,
        }
    }

    /// A chip, as by [`MotionChips::slave`], which each byte of a datagram asks for: so the call is no virtual one.
    #[inline]
    pub(super) fn slave(&mut self, chip: Chip, now: Nanos) -> Option<&mut dyn SpiSlave> {
        match self {
            Self::Tmc429sTmc262s(chips) => chips.slave(chip, now),
            Self::Tmc5160s(chips) => chips.slave(chip, now),
        }
    }

    #[inline]
    pub(super) fn chips_mut(&mut self) -> &mut dyn MotionChips {
        match self {
            Self::Tmc429sTmc262s(chips) => chips,
            Self::Tmc5160s(chips) => chips,
        }
    }
}
