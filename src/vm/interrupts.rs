//! Interrupts of a TMCL program (manual section 3.6.6): which are enabled, which are pending, and at which address
//! (the vector) the handler of each begins. Bank 3 of the global parameters holds the periods of the timers and the
//! edges that count.

use crate::param::{ALL_INTERRUPTS, Interrupt, TIMERS};
use crate::units::Micros;

/// Number of interrupt numbers. The highest number in use is 46, on a module with six axes and eight inputs; a `u64`
/// has one bit for each.
const NUMBERS: usize = 64;

/// Bits of an edge parameter in bank 3: changes from low to high count, changes from high to low count.
const RISING: i32 = 1;
const FALLING: i32 = 2;

/// The signals that the module hands to the interrupts each millisecond, as bits by interrupt number. They are events
/// of the last millisecond, and the present levels of inputs and stop switches, whose edges raise interrupts.
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

    /// Sets the levels of the stop switches of an axis; true for an active switch.
    pub fn stop_switches(&mut self, axis: u8, left: bool, right: bool) {
        let offset = axis.saturating_mul(2);
        self.level(Interrupt::StopLeft.first().saturating_add(offset), left);
        self.level(Interrupt::StopRight.first().saturating_add(offset), right);
    }

    /// Sets the levels of the digital inputs, input 0 in bit 0.
    pub fn inputs(&mut self, levels: u16) {
        self.levels |= u64::from(levels).unbounded_shl(Interrupt::Input.first().into());
    }

    fn level(&mut self, number: u8, level: bool) {
        if level {
            self.levels |= bit(number);
        }
    }
}

/// The settings and the state of all interrupts.
#[derive(Clone, Debug)]
pub struct Interrupts {
    /// Periods of the timers in milliseconds, to be read as unsigned 32 bits (manual section 5.4).
    periods: [i32; TIMERS as usize],
    /// Interrupts, one bit each, for which rising edges count; `falling` has those for which falling edges count.
    rising: u64,
    falling: u64,
    /// Addresses of the handlers, and the interrupts, one bit each, that have one.
    vectors: [u16; NUMBERS],
    handled: u64,
    enabled: u64,
    global: bool,
    pending: u64,
    /// For each timer that runs, when its period ends.
    timers: [Option<Micros>; TIMERS as usize],
    /// The levels of the previous millisecond, as bits by interrupt number; `None` after power-on.
    levels: Option<u64>,
}

impl Default for Interrupts {
    fn default() -> Self {
        Interrupts {
            periods: [0; _],
            rising: 0,
            falling: 0,
            vectors: [0; _],
            handled: 0,
            enabled: 0,
            global: false,
            pending: 0,
            timers: [None; _],
            levels: None,
        }
    }
}

impl Interrupts {
    /// EI and DI. An interrupt that is switched off is no longer pending.
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
            self.handled |= bit(number);
        }
    }

    /// The value of the bank 3 parameter with this number: a timer's period in ms, or the edges that count.
    pub fn setting(&self, number: u8) -> i32 {
        let edge = |edges: u64, value: i32| if edges & bit(number) != 0 { value } else { 0 };
        let period = self.periods.get(usize::from(number)).copied();
        period.unwrap_or_else(|| edge(self.rising, RISING) | edge(self.falling, FALLING))
    }

    /// Sets the bank 3 parameter with this number. A timer begins its new period at the next millisecond.
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

    /// Command 131: clears enables, vectors and pending interrupts; the parameters of bank 3 stay.
    pub fn reset(&mut self) {
        let Interrupts { periods, rising, falling, levels, .. } = *self;
        *self = Interrupts { periods, rising, falling, levels, ..Self::default() };
    }

    /// Takes the events and levels of this millisecond. While no program runs, events are dropped and timers stopped.
    pub fn look(&mut self, now: Micros, signals: Signals, program_runs: bool) {
        let edges = self.edges(signals.levels);
        if !program_runs {
            return self.forget();
        }
        self.pending |= (signals.events | edges | self.timers(now)) & self.enabled;
    }

    /// The time at which the next timer raises its interrupt, if inputs and events raise none before; `None` if a timer
    /// is to be started or stopped, or an interrupt is wanted now.
    pub(super) fn calm_until(&self) -> Option<Micros> {
        if self.wanted() {
            return None;
        }
        let mut until = Micros(u64::MAX);
        for ((number, timer), period) in (0..).zip(self.timers).zip(self.periods) {
            let runs = self.enabled & bit(number) != 0 && period != 0;
            if runs != timer.is_some() {
                return None;
            }
            until = until.min(timer.unwrap_or(until));
        }
        Some(until)
    }

    /// Drops pending interrupts and stops the timers, because the program has stopped.
    pub fn forget(&mut self) {
        self.pending = 0;
        self.timers = [None; _];
    }

    /// The pending interrupts that have a handler; none while interrupts are globally disabled.
    const fn candidates(&self) -> u64 {
        if self.global { self.pending & self.handled } else { 0 }
    }

    /// True while an interrupt with a handler is pending and interrupts are globally enabled.
    #[inline]
    pub(super) const fn wanted(&self) -> bool {
        self.candidates() != 0
    }

    /// The address of the handler to run next, and ends the pending state of its interrupt. Of several pending
    /// interrupts the lowest number goes first. `None` if no interrupt with a handler is pending, or interrupts are
    /// globally disabled.
    pub fn take(&mut self) -> Option<u16> {
        // Without a candidate this is 64, and there is no such interrupt.
        let number = self.candidates().trailing_zeros() as u8;
        let vector = self.vectors.get(usize::from(number)).copied()?;
        self.pending &= !bit(number);
        Some(vector)
    }

    /// The interrupts, as bits, whose level has changed in a direction that counts by bank 3.
    fn edges(&mut self, levels: u64) -> u64 {
        let before = self.levels.replace(levels).unwrap_or(levels);
        levels & !before & self.rising | before & !levels & self.falling
    }

    /// The timers, as bits, whose period has ended. The next period begins at the end of the last one, not at the time
    /// of the call, so that a late call does not delay a timer for good.
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
                // After whole periods were missed the next period begins now.
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
        signals.inputs(1);
        signals.reached(0);
        interrupts.look(T(1), signals, true);
        interrupts.look(T(2), signals, true);
        assert_eq!([(); 3].map(|()| interrupts.take()), [Some(7), Some(139), None]);
    }

    #[test]
    fn an_interrupt_without_a_handler_waits_for_one_and_holds_up_nothing() {
        let mut interrupts = armed(39);
        interrupts.enable(3, true);
        let mut signals = Signals::default();
        signals.reached(0);
        interrupts.look(T(0), signals, true);
        assert_eq!((interrupts.wanted(), interrupts.take()), (false, None));
        interrupts.set_vector(3, 0);
        assert_eq!((interrupts.wanted(), interrupts.take()), (true, Some(0)));
        assert!(!interrupts.wanted());
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
