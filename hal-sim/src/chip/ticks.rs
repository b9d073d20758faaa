//! The own time of a chip that has a clock: periods of its clock, or of a fixed divider behind it.

use crate::clock::{Nanos, SECOND};

/// Converts between virtual time and the count of ticks since power-on.
///
/// A tick has an exact time of n * divider / f_CLK seconds, which need not be whole nanoseconds; it is
/// converted from the count each time, so nothing accumulates.
#[derive(Debug)]
pub(super) struct TickClock {
    hz: u64,
    /// Periods of the clock in a tick.
    divider: u64,
    /// Length of a tick in 2^-n ns and this n, where there is such an n (2000 ns for 32 periods of 16 MHz, 125/2 ns for
    /// one): saves divisions.
    binary: Option<(Nanos, u32)>,
    /// The tick from which time is counted, and when it was.
    origin: (u64, Nanos),
    /// The time at which the clock was stopped; `None` while it runs.
    paused: Option<Nanos>,
}

/// The length of a tick in 2^-n ns, and this n, which is 9 at most: 10^9 has nine factors of two.
fn binary(hz: u64, divider: u64) -> Option<(Nanos, u32)> {
    (0..=9)
        .map(|shift| ((divider * SECOND) << shift, shift))
        .find(|(length, _)| length.is_multiple_of(hz))
        .map(|(length, shift)| (length / hz, shift))
}

impl TickClock {
    /// A clock of `hz` that starts to count at time 0, with a tick each `divider` periods.
    pub(super) fn new(hz: u32, divider: u64) -> Self {
        let hz = u64::from(hz).max(1);
        Self { hz, divider, binary: binary(hz, divider), origin: (0, 0), paused: None }
    }

    /// The last tick at or before `time` (not before a pause that has ended).
    pub(super) fn tick_at(&self, time: Nanos) -> u64 {
        let (first, from) = self.origin;
        let running = self.paused.unwrap_or(time).saturating_sub(from);
        first
            + match self.binary {
                Some((length, shift)) => (running << shift) / length,
                // floor(floor(t * hz / 10^9) / divider) is floor(t * hz / (divider * 10^9)); split at whole seconds so
                // that 64 bits do.
                None => (running / SECOND * self.hz + running % SECOND * self.hz / SECOND) / self.divider,
            }
    }

    /// The first nanosecond at which `tick` has happened.
    #[inline]
    pub(super) fn time_of(&self, tick: u64) -> Nanos {
        let (first, from) = self.origin;
        let ticks = tick.saturating_sub(first);
        let running = match self.binary {
            Some((length, shift)) => (ticks * length + (1 << shift) - 1) >> shift,
            None => {
                let cycles = ticks * self.divider;
                cycles / self.hz * SECOND + (cycles % self.hz * SECOND).div_ceil(self.hz)
            }
        };
        running + from
    }

    /// Stops the clock at `time`.
    pub(super) fn pause(&mut self, time: Nanos) {
        self.paused = Some(time);
    }

    /// Lets the clock go on at `time`; the span since the pause does not count.
    pub(super) fn resume(&mut self, time: Nanos) {
        if let Some(paused) = self.paused.take() {
            self.origin.1 += time.saturating_sub(paused);
        }
    }

    /// Goes on from `time` with a clock of `hz`.
    pub(super) fn set_hz(&mut self, hz: u32, time: Nanos) {
        self.origin = (self.tick_at(time), time);
        self.hz = u64::from(hz).max(1);
        self.binary = binary(self.hz, self.divider);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 16 MHz a period takes 62.5 ns, at 12 MHz 83 1/3 ns, at 11.0592 MHz 90.42 ns.
    #[test]
    fn periods_have_their_exact_times() {
        for (hz, third) in [(16_000_000, 188), (12_000_000, 250), (11_059_200, 272)] {
            let clock = TickClock::new(hz, 1);
            assert_eq!((clock.time_of(0), clock.time_of(3), clock.time_of(u64::from(hz))), (0, third, SECOND), "{hz}");
            assert_eq!((clock.tick_at(third - 1), clock.tick_at(third)), (2, 3), "{hz}");
        }
        assert_eq!(TickClock::new(16_000_000, 32).time_of(1), 2_000);
    }

    #[test]
    fn another_frequency_goes_on_from_the_present_tick() {
        let mut clock = TickClock::new(16_000_000, 1);
        clock.set_hz(12_000_000, SECOND);
        assert_eq!((clock.tick_at(SECOND), clock.tick_at(2 * SECOND)), (16_000_000, 28_000_000));
        assert_eq!(clock.time_of(16_000_000 + 12), SECOND + 1_000);
    }
}
