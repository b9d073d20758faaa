//! How fast virtual time goes while nobody pauses it.

use std::fmt;
use std::ops::RangeInclusive;

/// Permitted factors.
pub const SPEEDS: RangeInclusive<f64> = 0.001..=1000.0;

/// The speed of virtual time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// Seconds of virtual time per second of the clock, within [`SPEEDS`].
    Factor(f64),
    /// As fast as the computer can.
    Max,
}

impl Speed {
    /// Reads a factor, or `max`.
    ///
    /// # Errors
    /// The text is neither; the message says what to write.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Speed::Max);
        }
        let factor = text.parse().ok().filter(|factor| SPEEDS.contains(factor));
        factor.map(Speed::Factor).ok_or_else(|| {
            let (slowest, fastest) = (SPEEDS.start(), SPEEDS.end());
            format!("give a number from {slowest} to {fastest}, where 1 is real time, or max for as fast as can be")
        })
    }

    /// The factor; `None` for the speed that the computer decides.
    pub fn factor(self) -> Option<f64> {
        match self {
            Speed::Factor(factor) => Some(factor),
            Speed::Max => None,
        }
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Speed::Factor(factor) => factor.fmt(f),
            Speed::Max => f.write_str("max"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_positive_and_finite() {
        assert_eq!((Speed::parse("2.5"), Speed::parse("max")), (Ok(Speed::Factor(2.5)), Ok(Speed::Max)));
        for wrong in ["0", "-1", "nan", "inf", "1001", "fast", "", "Max"] {
            assert!(Speed::parse(wrong).unwrap_err().contains("from 0.001 to 1000"), "{wrong}");
        }
    }
}
