//! Scales: the position of values on an axis, and the ticks of the axis.

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};

/// A range of values with a margin at both ends, and round numbers as ticks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    /// The values of the ticks, ascending in equal steps.
    pub(super) ticks: Vec<f64>,
}

/// The margin at each end, as a fraction of the range.
const MARGIN: f64 = 0.05;

impl Scale {
    /// A scale with about `count` ticks.
    pub(super) fn over(low: f64, high: f64, count: usize) -> Self {
        // A single value is put in the middle of the scale.
        let (low, high) = if high > low { (low, high) } else { (low - 1.0, high + 1.0) };
        let step = round_step((high - low) / count.max(1) as f64);
        let margin = (high - low) * MARGIN;
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        let ticks = (first..=last).map(|tick| tick as f64 * step).collect();
        Scale { low: low - margin, high: high + margin, ticks }
    }

    /// Position of a value on the scale, from 0.0 at the lower end to 1.0 at the upper end.
    pub(super) fn fraction(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// The smallest of 1, 2, 5, 10, 20 ... that is not below `step`.
fn round_step(step: f64) -> f64 {
    let magnitude = 10_f64.powf(step.max(1.0).log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].into_iter().find(|round| round * magnitude >= step * 0.999);
    round.unwrap_or(10.0) * magnitude
}

/// A whole number with its digits in groups of three.
pub(super) fn grouped(value: f64) -> String {
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

/// The ticks of a time axis, and their unit.
pub(super) struct TimeAxis {
    /// The time of each tick and the number written below it.
    pub(super) ticks: Vec<(Nanos, String)>,
    /// Full name of the unit.
    pub(super) unit: &'static str,
}

impl TimeAxis {
    /// The time axis for a span from 0 on.
    pub(super) fn over(span: Nanos) -> Self {
        let (unit, name) = match span / SECOND {
            0 if span < SECOND / 2 => (MILLISECOND, "milliseconds"),
            0..300 => (SECOND, "seconds"),
            300..18_000 => (60 * SECOND, "minutes"),
            _ => (3600 * SECOND, "hours"),
        };
        // Ticks are whole multiples of a thousandth of the unit.
        let fine = unit / 1000;
        let step = round_step(span as f64 / fine as f64 / 10.0) as Nanos;
        let ticks = (0..=span / fine).step_by(step.max(1) as usize).map(|tick| {
            let text = match step {
                1000.. => grouped((tick / 1000) as f64),
                100.. => format!("{:.1}", tick as f64 / 1000.0),
                _ => format!("{:.2}", tick as f64 / 1000.0),
            };
            (tick * fine, text)
        });
        TimeAxis { ticks: ticks.collect(), unit: name }
    }
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

    #[test]
    fn time_has_the_unit_that_suits_it() {
        let axis = TimeAxis::over(10 * SECOND);
        assert_eq!((axis.unit, axis.ticks.len()), ("seconds", 11));
        let axis = TimeAxis::over(7 * MILLISECOND);
        assert_eq!((axis.unit, axis.ticks.last().unwrap().1.as_str()), ("milliseconds", "7"));
        let axis = TimeAxis::over(2 * SECOND);
        assert_eq!((axis.unit, axis.ticks[1].clone()), ("seconds", (200 * MILLISECOND, "0.2".into())));
        assert_eq!(TimeAxis::over(600 * SECOND).unit, "minutes");
    }
}
