//! The chip's own time: periods of CLK/32, which feed the ramp and the pulse dividers (datasheet 8.1.13).

use crate::clock::{Nanos, SECOND};

/// The fixed divider ahead of RAMP_DIV and PULSE_DIV (figure 8.2, CLOCK_DIV32).
const CLOCK_DIVIDER: u64 = 32;

/// Converts between virtual time and the count of clk32 periods since power-on.
///
/// A tick has an exact time of n * 32 / f_CLK seconds, which need not be whole nanoseconds; it is
/// converted from the count each time, so nothing accumulates.
#[derive(Debug)]
pub(super) struct TickClock {
    hz: u64,
    /// Length of a tick where it is a whole number of nanoseconds (2000 ns at 16 MHz): saves divisions.
    whole: Option<Nanos>,
    /// Time spent so far in power-down, when no clock runs (8.2.4.3).
    stopped: Nanos,
    /// The time at which the clock was stopped; `None` while it runs.
    paused: Option<Nanos>,
}

impl TickClock {
    /// A clock of `hz` that starts to count at time 0.
    pub(super) fn new(hz: u32) -> Self {
        let hz = u64::from(hz).max(1);
        let whole = (CLOCK_DIVIDER * SECOND).is_multiple_of(hz).then(|| CLOCK_DIVIDER * SECOND / hz);
        Self { hz, whole, stopped: 0, paused: None }
    }

    /// The last tick at or before `time` (not before a pause that has ended).
    pub(super) fn tick_at(&self, time: Nanos) -> u64 {
        let running = self.paused.unwrap_or(time).saturating_sub(self.stopped);
        match self.whole {
            Some(length) => running / length,
            // floor(floor(t * hz / 10^9) / 32) is floor(t * hz / (32 * 10^9)); split at whole seconds so
            // that 64 bits do.
            None => (running / SECOND * self.hz + running % SECOND * self.hz / SECOND) / CLOCK_DIVIDER,
        }
    }

    /// The first nanosecond at which `tick` has happened.
    pub(super) fn time_of(&self, tick: u64) -> Nanos {
        let running = match self.whole {
            Some(length) => tick * length,
            None => {
                let cycles = tick * CLOCK_DIVIDER;
                cycles / self.hz * SECOND + (cycles % self.hz * SECOND).div_ceil(self.hz)
            }
        };
        running + self.stopped
    }

    /// The number of ticks that cover `cycles` periods of CLK.
    pub(super) fn ticks_for(cycles: u64) -> u64 {
        cycles.div_ceil(CLOCK_DIVIDER)
    }

    /// Stops the clock at `time`.
    pub(super) fn pause(&mut self, time: Nanos) {
        self.paused = Some(time);
    }

    /// Lets the clock go on at `time`; the span since the pause does not count.
    pub(super) fn resume(&mut self, time: Nanos) {
        if let Some(paused) = self.paused.take() {
            self.stopped += time.saturating_sub(paused);
        }
    }
}
