//! Samples of a value: how many, their mean and their spread.

/// The facts that several samples of a value have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Stats {
    count: u32,
    sum: i64,
    /// The lowest sample.
    pub(super) low: i32,
    /// The highest sample.
    pub(super) high: i32,
}

impl Stats {
    /// Takes in a sample.
    pub(super) fn take(&mut self, sample: i32) {
        (self.low, self.high) = match self.count {
            0 => (sample, sample),
            _ => (self.low.min(sample), self.high.max(sample)),
        };
        self.count += 1;
        self.sum += i64::from(sample);
    }

    /// The mean, rounded; 0 without a sample.
    pub(super) fn mean(&self) -> i32 {
        let count = i64::from(self.count.max(1));
        // Samples have 32 bits, and so has their mean.
        i32::try_from((2 * self.sum + count).div_euclid(2 * count)).unwrap_or_default()
    }

    /// How far the samples are apart.
    pub(super) fn spread(&self) -> i32 {
        self.high.saturating_sub(self.low)
    }
}

/// The values that were measured while the motor turned at a constant speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Reading {
    /// The load value of stallGuard2 (parameter 206).
    pub(super) load: Stats,
    /// The current that coolStep has set (parameter 180).
    pub(super) current: Stats,
}

impl Reading {
    /// Takes in a sample of both.
    pub(super) fn take(&mut self, load: i32, current: i32) {
        self.load.take(load);
        self.current.take(current);
    }

    /// How many samples it is made of.
    pub(super) fn count(&self) -> u32 {
        self.load.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_spread() {
        let of = |samples: &[i32]| {
            let mut stats = Stats::default();
            samples.iter().for_each(|sample| stats.take(*sample));
            (stats.mean(), stats.low, stats.high, stats.spread())
        };
        assert_eq!(of(&[5]), (5, 5, 5, 0));
        assert_eq!(of(&[1, 2]), (2, 1, 2, 1));
        assert_eq!(of(&[10, 0, 3]), (4, 0, 10, 10));
        assert_eq!(of(&[-3, -4]), (-3, -4, -3, 1));
        assert_eq!(of(&[]), (0, 0, 0, 0));
        assert_eq!(of(&[i32::MIN, i32::MAX]), (0, i32::MIN, i32::MAX, i32::MAX), "the mean of -1/2 is rounded up");
    }

    #[test]
    fn a_reading_has_both_values_of_each_sample() {
        let mut reading = Reading::default();
        assert_eq!(reading.count(), 0);
        reading.take(300, 16);
        reading.take(310, 8);
        assert_eq!(reading.count(), 2);
        assert_eq!((reading.load.mean(), reading.load.spread()), (305, 10));
        assert_eq!((reading.current.mean(), reading.current.spread()), (12, 8));
    }
}
