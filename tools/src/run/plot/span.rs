//! The axis of time: its ticks, in the unit that suits the span.

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};

use crate::svg::{grouped, round_step};

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
