//! Middle and ends of a set of samples.

use super::host::CYCLES_PER_MICROSECOND;

/// Of samples in cycles: the median, what 99 of 100 do not exceed, and the largest.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Spread {
    pub(crate) median: u64,
    pub(crate) p99: u64,
    pub(crate) max: u64,
}

impl Spread {
    /// Of nothing, all are zero.
    pub(crate) fn of(mut samples: Vec<u64>) -> Self {
        samples.sort_unstable();
        let at = |index: usize| samples.get(index).copied().unwrap_or_default();
        let count = samples.len();
        Self {
            median: at(count / 2),
            p99: at((count * 99).div_ceil(100).saturating_sub(1)),
            max: at(count.saturating_sub(1)),
        }
    }

    /// Cells of a table: each in cycles, and the median in microseconds.
    pub(crate) fn cells(&self) -> [String; 4] {
        [grouped(self.median), grouped(self.p99), grouped(self.max), microseconds(self.median)]
    }
}

/// A number with a space between thousands.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Core cycles in microseconds.
pub(crate) fn microseconds(cycles: u64) -> String {
    format!("{:.1}", cycles as f64 / CYCLES_PER_MICROSECOND as f64)
}

/// A share in percent.
pub(crate) fn percent(part: u64, whole: u64) -> String {
    format!("{:.2} %", 100.0 * part as f64 / whole.max(1) as f64)
}
