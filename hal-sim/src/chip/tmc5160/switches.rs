//! The reference switches: which are active, what they stop, and what an edge of theirs latches (12.4, 6.3.2).

use super::registers::{Registers, address::SW_MODE};

/// Bits of SW_MODE (6.3.2.1).
pub(super) mod mode {
    pub(crate) const STOP_L: u32 = 0;
    pub(crate) const STOP_R: u32 = 1;
    pub(crate) const POL_L: u32 = 2;
    pub(crate) const POL_R: u32 = 3;
    pub(crate) const SWAP: u32 = 4;
    /// Left and active; left and inactive, right and active, right and inactive follow.
    pub(crate) const LATCH: u32 = 5;
    pub(crate) const LATCH_ENCODER: u32 = 9;
    pub(crate) const SG_STOP: u32 = 10;
    pub(crate) const SOFT: u32 = 11;
}

/// Something for the left and for the right switch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) left: bool,
    pub(super) right: bool,
}

/// The motion, as far as a stop condition depends on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// The direction in which the motor is to move: 1, -1, or 0.
    pub(super) demand: i32,
    /// The direction in which it moves.
    pub(super) direction: i32,
    /// Hold mode.
    pub(super) held: bool,
}

/// The switch inputs.
#[derive(Debug, Default)]
pub(super) struct Switches {
    /// The levels at REFL and REFR.
    levels: Pair,
    /// status_latch_l and status_latch_r.
    latched: Pair,
    /// event_stop_l and event_stop_r.
    stopping: Pair,
}

impl Switches {
    /// Sets the levels at the pins. Returns whether the edges that this makes are to latch the position.
    pub(super) fn set(&mut self, levels: Pair, registers: &Registers) -> bool {
        let before = self.active(registers);
        self.levels = levels;
        let now = self.active(registers);
        let edge = |before: bool, now: bool, low: u32| before != now && registers.bit(SW_MODE, low + u32::from(!now));
        let left = edge(before.left, now.left, mode::LATCH);
        let right = edge(before.right, now.right, mode::LATCH + 2);
        self.latched.left |= left;
        self.latched.right |= right;
        left || right
    }

    /// The levels at the pins.
    pub(super) fn levels(&self) -> Pair {
        self.levels
    }

    /// Forgets everything but the levels.
    pub(super) fn reset(&mut self) {
        *self = Self { levels: self.levels, ..Self::default() };
    }

    /// The active switches. Polarities belong to the switches that remain after swapping.
    pub(super) fn active(&self, registers: &Registers) -> Pair {
        let Pair { left, right } = self.levels;
        let (left, right) = if registers.bit(SW_MODE, mode::SWAP) { (right, left) } else { (left, right) };
        Pair { left: left != registers.bit(SW_MODE, mode::POL_L), right: right != registers.bit(SW_MODE, mode::POL_R) }
    }

    /// The active switches that are enabled as stop switches.
    pub(super) fn stops(&self, registers: &Registers) -> Pair {
        let active = self.active(registers);
        Pair {
            left: active.left && registers.bit(SW_MODE, mode::STOP_L),
            right: active.right && registers.bit(SW_MODE, mode::STOP_R),
        }
    }

    /// Brings the stop conditions up to date. They end with the switch, with hold mode and with a move to the opposite
    /// direction, but not while the motor still moves towards the switch (6.3.2.2).
    pub(super) fn follow(&mut self, motion: Motion, registers: &Registers) {
        let stops = self.stops(registers);
        let condition = |was: bool, stops: bool, towards: i32| {
            stops
                && (motion.direction == towards
                    || !motion.held && motion.demand != -towards && (was || motion.demand == towards))
        };
        self.stopping = Pair {
            left: condition(self.stopping.left, stops.left, -1),
            right: condition(self.stopping.right, stops.right, 1),
        };
    }

    /// The stop conditions.
    pub(super) fn stopping(&self) -> Pair {
        self.stopping
    }

    /// Whether edges have latched a position.
    pub(super) fn latched(&self) -> Pair {
        self.latched
    }

    /// Clears these flags where `flags` has them.
    pub(super) fn clear_latched(&mut self, flags: Pair) {
        self.latched.left &= !flags.left;
        self.latched.right &= !flags.right;
    }
}
