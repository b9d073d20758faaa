//! Interrupts of a TMCL program (manual section 3.6.6): which events are pending, which of them are enabled, and the
//! address of the handler (the vector) that each calls. Bank 3 of the global parameters has periods of timers and
//! edges.

use crate::param::{ALL_INTERRUPTS, Interrupt, TIMERS};
use crate::units::Micros;

/// Interrupt numbers; the manual's go up to 42, those of a module with six axes and eight inputs up to 46.
const NUMBERS: usize = 64;

/// Bits of a parameter in bank 3: low to high counts, high to low counts.
const RISING: i32 = 1;
const FALLING: i32 = 2;

/// No vector.
const NONE: u16 = u16::MAX;

/// What the module hands to the interrupts each millisecond: events since the last time, and the levels of inputs and
/// stop switches, whose edges are events; both as bits, by interrupt number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Signals {
    events: u64,
    levels: u64,
}

impl Signals {
    /// The target position of an axis was reached: parameter 8 became 1.
    pub fn reached(&mut self, axis: u8) {
        self.events |= bit(Interrupt::PositionReached.first().saturating_add(axis));
    }

    /// stallGuard2 has stopped an axis.
    pub fn stall(&mut self, axis: u8) {
        self.events |= bit(Interrupt::Stall.first().saturating_add(axis));
    }

    /// Deviation supervision has stopped an axis.
    pub fn deviation(&mut self, axis: u8) {
        self.events |= bit(Interrupt::Deviation.first().saturating_add(axis));
    }

    /// Which stop switches of an axis are active.
    pub fn stop_switches(&mut self, axis: u8, left: bool, right: bool) {
        let offset = axis.saturating_mul(2);
        self.level(Interrupt::StopLeft.first().saturating_add(offset), left);
        self.level(Interrupt::StopRight.first().saturating_add(offset), right);
    }

    /// The levels of the digital inputs.
    pub fn inputs(&mut self, levels: &[bool]) {
        for (number, level) in (Interrupt::Input.first()..).zip(levels) {
            self.level(number, *level);
        }
    }

    fn level(&mut self, number: u8, level: bool) {
        if level {
            self.levels |= bit(number);
        }
    }
}

/// The state of all interrupts.
#[derive(Clone, Debug)]
pub struct Interrupts {
    /// Milliseconds, unsigned 32 bits (manual section 5.4).
    periods: [i32; TIMERS as usize],
    /// Which edges of a level count, as bits by interrupt number.
    rising: u64,
    falling: u64,
    vectors: [u16; NUMBERS],
    enabled: u64,
    global: bool,
    pending: u64,
    /// When each timer that runs is due.
    timers: [Option<Micros>; TIMERS as usize],
    /// The levels at the last look, once there was one.
    levels: Option<u64>,
}

impl Default for Interrupts {
    fn default() -> Self {
        Interrupts {
            periods: [0; _],
            rising: 0,
            falling: 0,
            vectors: [NONE; _],
            enabled: 0,
            global: false,
            pending: 0,
            timers: [None; _],
            levels: None,
        }
    }
}

impl Interrupts {
    /// EI and DI. An interrupt that is switched off forgets its event.
    pub fn enable(&mut self, number: u8, on: bool) {
        if number == ALL_INTERRUPTS {
            self.global = on;
        } else if on {
            self.enabled |= bit(number);
        } else {
            self.enabled &= !bit(number);
            self.pending &= !bit(number);
        }
    }

    /// VECT: sets the address of the handler.
    pub fn set_vector(&mut self, number: u8, address: u16) {
        if let Some(vector) = self.vectors.get_mut(usize::from(number)) {
            *vector = address;
        }
    }

    /// The parameter of bank 3 with the number of an interrupt.
    pub fn setting(&self, number: u8) -> i32 {
        let edge = |edges: u64, value: i32| if edges & bit(number) != 0 { value } else { 0 };
        let period = self.periods.get(usize::from(number)).copied();
        period.unwrap_or_else(|| edge(self.rising, RISING) | edge(self.falling, FALLING))
    }

    /// Changes it. A timer starts anew with its period.
    pub fn set(&mut self, number: u8, value: i32) {
        let index = usize::from(number);
        if let Some((period, timer)) = self.periods.get_mut(index).zip(self.timers.get_mut(index)) {
            (*period, *timer) = (value, None);
            return;
        }
        for (edges, wanted) in [(&mut self.rising, RISING), (&mut self.falling, FALLING)] {
            if value & wanted != 0 {
                *edges |= bit(number);
            } else {
                *edges &= !bit(number);
            }
        }
    }

    /// Command 131: enables, vectors and pending events go, bank 3 stays.
    pub fn reset(&mut self) {
        let Interrupts { periods, rising, falling, levels, .. } = *self;
        *self = Interrupts { periods, rising, falling, levels, ..Self::default() };
    }

    /// Takes the events and levels of this millisecond. While no program runs events are dropped and timers stand.
    pub fn look(&mut self, now: Micros, signals: Signals, program_runs: bool) {
        let edges = self.edges(signals.levels);
        if !program_runs {
            return self.forget();
        }
        self.pending |= (signals.events | edges | self.timers(now)) & self.enabled;
    }

    /// The program has stopped: pending events are dropped, and timers stand.
    pub fn forget(&mut self) {
        self.pending = 0;
        self.timers = [None; _];
    }

    /// The address of the handler that is to run next, if one may run: of the pending interrupts that with the lowest
    /// number goes first. Its event is no longer pending then.
    pub fn take(&mut self) -> Option<u16> {
        if !self.global {
            return None;
        }
        let mut candidates = self.pending;
        while candidates != 0 {
            let number = candidates.trailing_zeros();
            let vector = self.vectors.get(usize::try_from(number).ok()?).copied()?;
            if vector != NONE {
                self.pending &= !1_u64.wrapping_shl(number);
                return Some(vector);
            }
            candidates &= candidates.wrapping_sub(1);
        }
        None
    }

    /// Interrupts whose level has changed in the direction that bank 3 asks for, as bits.
    fn edges(&mut self, levels: u64) -> u64 {
        let before = self.levels.replace(levels).unwrap_or(levels);
        levels & !before & self.rising | before & !levels & self.falling
    }

    /// Timers that are due, as bits. Each keeps its rhythm, however late the call is.
    fn timers(&mut self, now: Micros) -> u64 {
        let mut due = 0;
        for ((number, timer), period) in (0..).zip(&mut self.timers).zip(self.periods) {
            let period = Micros::from_millis(period.cast_unsigned().into());
            if self.enabled & bit(number) == 0 || period == Micros(0) {
                *timer = None;
                continue;
            }
            let at = *timer.get_or_insert(now.after(period));
            if now >= at {
                due |= bit(number);
                let next = at.after(period);
                // Where whole periods were missed the rhythm begins anew.
                *timer = Some(if next > now { next } else { now.after(period) });
            }
        }
        due
    }
}

fn bit(number: u8) -> u64 {
    1_u64.unbounded_shl(number.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: fn(u64) -> Micros = Micros::from_millis;

    fn armed(number: u8) -> Interrupts {
        let mut interrupts = Interrupts::default();
        interrupts.set_vector(number, u16::from(number) + 100);
        interrupts.enable(number, true);
        interrupts.enable(ALL_INTERRUPTS, true);
        interrupts
    }

    #[test]
    fn lowest_number_first_and_each_event_once() {
        let mut interrupts = armed(39);
        interrupts.set_vector(3, 7);
        interrupts.enable(3, true);
        interrupts.set(39, 1);
        interrupts.look(T(0), Signals::default(), true);
        let mut signals = Signals::default();
        signals.inputs(&[true]);
        signals.reached(0);
        interrupts.look(T(1), signals, true);
        interrupts.look(T(2), signals, true);
        assert_eq!([(); 3].map(|()| interrupts.take()), [Some(7), Some(139), None]);
    }

    #[test]
    fn events_wait_for_the_global_enable_but_not_for_their_own() {
        let mut interrupts = armed(3);
        let mut signals = Signals::default();
        signals.reached(0);
        interrupts.enable(3, false);
        interrupts.look(T(0), signals, true);
        interrupts.enable(3, true);
        assert_eq!(interrupts.take(), None);
        interrupts.enable(ALL_INTERRUPTS, false);
        interrupts.look(T(1), signals, true);
        assert_eq!(interrupts.take(), None);
        interrupts.enable(ALL_INTERRUPTS, true);
        assert_eq!(interrupts.take(), Some(103));
        interrupts.look(T(2), signals, false);
        assert_eq!(interrupts.take(), None, "no program runs");
    }

    #[test]
    fn edges_as_bank_3_asks_for_them() {
        for (transition, expected) in [(0, [false, false]), (1, [true, false]), (2, [false, true]), (3, [true, true])] {
            let mut interrupts = armed(28);
            interrupts.set(28, transition);
            let taken = [false, true, false].map(|right| {
                let mut signals = Signals::default();
                signals.stop_switches(0, false, right);
                interrupts.look(T(0), signals, true);
                interrupts.take().is_some()
            });
            assert_eq!(taken, [false, expected[0], expected[1]], "transition {transition}");
        }
    }

    #[test]
    fn a_timer_keeps_its_rhythm_when_the_look_is_late() {
        let mut interrupts = armed(0);
        interrupts.set(0, 10);
        let late = |n: u64| Micros(n * 1_000 + n * 377 % 900);
        let due: Vec<u64> = (0..100)
            .filter(|n| {
                interrupts.look(late(*n), Signals::default(), true);
                interrupts.take().is_some()
            })
            .collect();
        assert_eq!(due, [10, 20, 30, 40, 50, 60, 70, 80, 90]);
    }
}
