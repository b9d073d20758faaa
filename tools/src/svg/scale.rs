//! Scales: the position of values on an axis, and the ticks of the axis.

/// A range of values with a margin at both ends, and round numbers as ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    low: f64,
    high: f64,
    /// The values of the ticks, ascending in equal steps.
    pub ticks: Vec<f64>,
}

/// The margin at each end, as a fraction of the range.
const MARGIN: f64 = 0.05;

impl Scale {
    /// A scale with about `count` ticks.
    pub fn over(low: f64, high: f64, count: usize) -> Self {
        // A single value is put in the middle of the scale.
        let (low, high) = if high > low { (low, high) } else { (low - 1.0, high + 1.0) };
        let step = round_step((high - low) / count.max(1) as f64);
        let margin = (high - low) * MARGIN;
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        let ticks = (first..=last).map(|tick| tick as f64 * step).collect();
        Scale { low: low - margin, high: high + margin, ticks }
    }

    /// Position of a value on the scale, from 0.0 at the lower end to 1.0 at the upper end.
    pub fn fraction(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// The smallest of 1, 2, 5, 10, 20 ... that is not below `step`.
pub fn round_step(step: f64) -> f64 {
    let magnitude = 10_f64.powf(step.max(1.0).log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].into_iter().find(|round| round * magnitude >= step * 0.999);
    round.unwrap_or(10.0) * magnitude
}

/// A whole number with its digits in groups of three.
pub fn grouped(value: f64) -> String {
    let digits = format!("{:.0}", value.abs());
    let mut text = String::from(if value < 0.0 { "\u{2212}" } else { "" });
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            // U+2009 is a narrow space.
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(Scale::over(-3.0, 51_200.0, 4).ticks, [0.0, 20_000.0, 40_000.0]);
        assert_eq!(Scale::over(0.0, 0.0, 4).ticks, [-1.0, 0.0, 1.0]);
        assert_eq!(Scale::over(-512_000.0, 512_000.0, 4).ticks, [-500_000.0, 0.0, 500_000.0]);
        assert_eq!(Scale::over(0.0, 32.0, 3).ticks, [0.0, 20.0]);
        let scale = Scale::over(0.0, 1000.0, 4);
        assert_eq!(scale.fraction(500.0), 0.5);
        assert!(scale.fraction(0.0) > 0.0 && scale.fraction(1000.0) < 1.0);
    }

    #[test]
    fn numbers_have_their_digits_in_groups() {
        assert_eq!(
            [0.0, 999.0, -1_000.0, 1_234_567.0].map(grouped),
            ["0", "999", "−1\u{2009}000", "1\u{2009}234\u{2009}567"]
        );
    }
}
