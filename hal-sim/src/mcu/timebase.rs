//! Core cycles and nanoseconds.

use super::peripheral::Cycles;
use crate::clock::{Nanos, SECOND};

/// Converts between core cycles and virtual time. The core clock changes; from each change on it counts anew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timebase {
    hz: u64,
    cycles: Cycles,
    nanos: Nanos,
}

impl Timebase {
    /// Cycle `cycles` is at `nanos`, and from there on the clock has `hz`.
    pub(super) fn new(hz: u64, cycles: Cycles, nanos: Nanos) -> Self {
        Self { hz: hz.max(1), cycles, nanos }
    }

    /// The core clock in Hz.
    pub(super) fn hz(&self) -> u64 {
        self.hz
    }

    /// From `cycles` on the clock has `hz`.
    pub(super) fn change(&mut self, hz: u64, cycles: Cycles) {
        *self = Self::new(hz, cycles, self.nanos(cycles));
    }

    /// The time of `cycles`, which is not before the last change.
    pub(super) fn nanos(&self, cycles: Cycles) -> Nanos {
        let since = cycles.saturating_sub(self.cycles);
        // Past 64 bits it is split at whole seconds.
        let split = || since / self.hz * SECOND + since % self.hz * SECOND / self.hz;
        self.nanos + since.checked_mul(SECOND).map_or_else(split, |scaled| scaled / self.hz)
    }

    /// The first cycle at or after `nanos`.
    pub(super) fn cycles(&self, nanos: Nanos) -> Cycles {
        self.cycles + self.span(nanos.saturating_sub(self.nanos))
    }

    /// The cycles that cover a span of time.
    pub(super) fn span(&self, nanos: Nanos) -> Cycles {
        nanos / SECOND * self.hz + (nanos % SECOND * self.hz).div_ceil(SECOND)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let mut base = Timebase::new(16_000_000, 0, 0);
        assert_eq!(base.nanos(16), 1_000);
        base.change(168_000_000, 32);
        assert_eq!(base.nanos(32), 2_000);
        assert_eq!(base.nanos(32 + 168_000_000 * 1_000), 2_000 + 1_000 * SECOND);
        for cycles in 32..2_000 {
            assert_eq!(base.cycles(base.nanos(cycles)), cycles);
        }
        assert_eq!(base.span(SECOND), 168_000_000);
        assert_eq!(base.span(1), 1);
    }
}
