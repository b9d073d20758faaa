//! A recording of the real motion of a rotor, which tests and plots measure. Times are in nanoseconds of virtual time.

use super::motor::FULL_STEP;
use crate::clock::{Nanos, SECOND};

/// The positions of rotor and field at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Virtual time.
    pub at: Nanos,
    /// Position of the rotor in 1/256 full steps.
    pub rotor: i64,
    /// Position that the rotor would have without lost steps, in 1/256 full steps.
    pub field: i64,
}

/// A recording: a sample for each step, or at most one in each interval.
#[derive(Clone, Debug)]
pub struct Trace {
    /// The shortest time between two samples; 0 keeps a sample of each step.
    interval: Nanos,
    samples: Vec<Sample>,
    /// The lowest and the highest position of the rotor so far.
    range: Option<(i64, i64)>,
}

impl Trace {
    /// An empty recording. With an `interval` of zero each step is a sample; otherwise at most one step per interval
    /// is. The range covers all steps in either case.
    pub fn new(interval: Nanos) -> Self {
        Self { interval, samples: Vec::new(), range: None }
    }

    /// The samples in the order of time.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// The lowest and the highest position that the rotor has had; `None` before the first step.
    pub fn range(&self) -> Option<(i64, i64)> {
        self.range
    }

    /// The position of the rotor at a time: that of the last sample not after it.
    pub fn rotor_at(&self, at: Nanos) -> Option<i64> {
        let after = self.samples.partition_point(|sample| sample.at <= at);
        let sample = self.samples.get(after.checked_sub(1)?)?;
        Some(sample.rotor)
    }

    /// The mean speed of the rotor between two times, in full steps per second; negative speeds go down.
    pub fn speed(&self, from: Nanos, to: Nanos) -> Option<f64> {
        let moved = self.rotor_at(to)? - self.rotor_at(from)?;
        let took = to.checked_sub(from).filter(|&took| took > 0)?;
        Some(moved as f64 / FULL_STEP as f64 * SECOND as f64 / took as f64)
    }

    /// The highest mean speed over any `window` of time that begins with a sample, in full steps per
    /// second, without sign.
    pub fn top_speed(&self, window: Nanos) -> f64 {
        let last = self.samples.last().map_or(0, |sample| sample.at);
        self.samples
            .iter()
            .take_while(|sample| sample.at + window <= last)
            .filter_map(|sample| self.speed(sample.at, sample.at + window))
            .fold(0.0, |top, speed| speed.abs().max(top))
    }

    /// The time at which a mean speed first reaches `speed` (full steps per second, in either direction). This is the
    /// end of the first `window` of time, beginning with a sample, over which the mean speed is that high.
    pub fn reaches_speed(&self, speed: f64, window: Nanos) -> Option<Nanos> {
        let last = self.samples.last()?.at;
        self.samples
            .iter()
            .map(|sample| (sample.at, sample.at + window))
            .take_while(|&(_, to)| to <= last)
            .find(|&(from, to)| self.speed(from, to).is_some_and(|v| v.abs() >= speed))
            .map(|(_, to)| to)
    }

    /// How far the rotor went beyond `target` on a way that began at position `start`; all in 1/256 full steps.
    pub fn overshoot(&self, start: i64, target: i64) -> i64 {
        let Some((lowest, highest)) = self.range else {
            return 0;
        };
        let beyond = if target >= start { highest - target } else { target - lowest };
        beyond.max(0)
    }

    pub(super) fn record(&mut self, at: Nanos, rotor: i64, field: i64) {
        let (lowest, highest) = self.range.unwrap_or((rotor, rotor));
        self.range = Some((lowest.min(rotor), highest.max(rotor)));
        let due = self.samples.last().is_none_or(|last| at >= last.at + self.interval);
        if due {
            self.samples.push(Sample { at, rotor, field });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::MILLISECOND;

    /// Half a second at 500 full steps per second, and then a second at 1000.
    fn recorded(interval: Nanos) -> Trace {
        let mut trace = Trace::new(interval);
        let mut rotor = 0;
        for step in 0..250 {
            trace.record(step * 2 * MILLISECOND, rotor, rotor);
            rotor += FULL_STEP;
        }
        for step in 0..1_000 {
            trace.record(500 * MILLISECOND + step * MILLISECOND, rotor, rotor);
            rotor += FULL_STEP;
        }
        trace
    }

    #[test]
    fn speeds_are_measured_in_full_steps_per_second() {
        let trace = recorded(0);
        assert_eq!(trace.samples().len(), 1_250);
        assert_eq!(trace.speed(0, 400 * MILLISECOND), Some(500.0));
        assert_eq!(trace.speed(500 * MILLISECOND, SECOND), Some(1000.0));
        assert_eq!(trace.speed(5, 5), None);
        assert_eq!(trace.top_speed(20 * MILLISECOND), 1000.0);
        // A window of 20 ms that ends at 520 ms is the first to lie wholly at the higher speed.
        assert_eq!(trace.reaches_speed(1000.0, 20 * MILLISECOND), Some(520 * MILLISECOND));
        assert_eq!(trace.reaches_speed(1001.0, 20 * MILLISECOND), None);
    }

    #[test]
    fn an_interval_thins_the_samples_but_not_the_range() {
        let trace = recorded(100 * MILLISECOND);
        assert_eq!(trace.samples().len(), 15);
        assert_eq!(trace.range(), Some((0, 1_249 * FULL_STEP)));
        assert_eq!(trace.overshoot(0, 1_249 * FULL_STEP - 3), 3);
        assert_eq!(trace.overshoot(500, 100), 100);
    }

    #[test]
    fn nothing_recorded_is_nothing_measured() {
        let trace = Trace::new(0);
        assert_eq!(trace.rotor_at(5), None);
        assert_eq!((trace.range(), trace.top_speed(1)), (None, 0.0));
        assert_eq!(trace.overshoot(0, 5), 0);
    }
}
