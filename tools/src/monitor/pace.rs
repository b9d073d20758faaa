//! Whether the wanted interval between two samples can be kept.

use std::time::Duration;

/// So many late samples show that it is not a hiccup.
const ENOUGH: u32 = 3;

/// The wanted interval, and the samples that have taken longer.
#[derive(Clone, Debug)]
pub struct Pace {
    interval: Duration,
    samples: u32,
    late: u32,
    /// Time that the late samples have taken together.
    total: Duration,
}

impl Pace {
    /// An interval that is wanted; 0 asks for as many samples as there can be.
    pub fn new(interval: Duration) -> Self {
        Pace { interval, samples: 0, late: 0, total: Duration::ZERO }
    }

    /// Takes note of the time that a sample has taken. Gives the time that one takes, once, when it is clear that the
    /// interval is too short for it.
    pub fn took(&mut self, time: Duration) -> Option<Duration> {
        self.samples = self.samples.saturating_add(1);
        // An interval of 0 asks for as many samples as there can be.
        if self.interval.is_zero() || time <= self.interval {
            return None;
        }
        self.late = self.late.saturating_add(1);
        if self.late > ENOUGH {
            return None;
        }
        self.total += time;
        (self.late == ENOUGH).then(|| self.total / ENOUGH)
    }

    /// The same at the end of a few samples: most of them were late, and it has not been told.
    pub fn at_the_end(&self) -> Option<Duration> {
        (self.late > 0 && self.late < ENOUGH && 2 * self.late > self.samples).then(|| self.total / self.late)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The milliseconds that are told after samples that take so many, and at the end.
    fn told(interval: u64, samples: &[u64]) -> (Vec<u128>, Option<u128>) {
        let mut pace = Pace::new(Duration::from_millis(interval));
        let told = samples.iter().filter_map(|time| pace.took(Duration::from_millis(*time)));
        (told.map(|time| time.as_millis()).collect(), pace.at_the_end().map(|time| time.as_millis()))
    }

    #[test]
    fn what_cannot_be_kept_is_told_once() {
        assert_eq!(told(100, &[160, 150, 170, 400, 400]), (vec![160], None));
        assert_eq!(told(100, &[160, 180]), (vec![], Some(170)));
        assert_eq!(told(100, &[160]), (vec![], Some(160)));
    }

    #[test]
    fn a_hiccup_is_not_told() {
        assert_eq!(told(100, &[20, 160, 20, 20]), (vec![], None));
        assert_eq!(told(100, &[100, 100]), (vec![], None));
        assert_eq!(told(0, &[160, 160, 160]), (vec![], None));
    }
}
