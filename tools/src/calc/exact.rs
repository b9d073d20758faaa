//! Exact fractions: what is converted to and fro comes out as it was, and what is rounded is rounded once.

use std::ops::Mul;

/// Most digits of a number that is read, before and behind its point together.
///
/// With so many a number times the largest factor between two units, 2^36 * 65535 * 256 / 60, stays within 128 bits.
const MOST_DIGITS: usize = 15;
/// Decimals of a number that is shown.
const DECIMALS: usize = 6;
/// Digits that a number below 1 is shown with, from the first that is not 0, even if they go beyond the decimals.
const SIGNIFICANT: usize = 4;

/// A fraction in lowest terms, whose denominator is above 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Exact {
    numerator: i128,
    denominator: i128,
}

impl Exact {
    /// The fraction of two numbers, the second of which is above 0.
    pub(super) fn ratio(numerator: i128, denominator: i128) -> Self {
        let divisor = common(numerator.abs(), denominator);
        Exact { numerator: numerator / divisor, denominator: denominator / divisor }
    }

    /// A whole number.
    pub(super) fn whole(number: impl Into<i128>) -> Self {
        Exact { numerator: number.into(), denominator: 1 }
    }

    /// Reads a number such as `51200` or `-0.5`; `None` if the text is none, or has more than 15 digits.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        let all = format!("{whole}{fraction}");
        if all.len() > MOST_DIGITS || !all.bytes().all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        let sign = if text.starts_with('-') { -1 } else { 1 };
        let decimals = u32::try_from(fraction.len()).ok()?;
        Some(Self::ratio(sign * all.parse::<i128>().ok()?, 10_i128.pow(decimals)))
    }

    /// The reciprocal of a fraction above 0.
    pub(super) fn inverse(self) -> Self {
        Exact { numerator: self.denominator, denominator: self.numerator }
    }

    /// The nearest whole number; a half is rounded away from 0.
    pub(super) fn rounded(self) -> i128 {
        let magnitude = (2 * self.numerator.abs() + self.denominator) / (2 * self.denominator);
        self.numerator.signum() * magnitude
    }

    /// The number in floating point, for estimates.
    pub(super) fn approximate(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }

    /// True if the number is below 0.
    pub(super) fn is_negative(self) -> bool {
        self.numerator < 0
    }

    /// True if the number is 0.
    pub(super) fn is_zero(self) -> bool {
        self.numerator == 0
    }

    /// The number as a decimal: in full if six decimals are enough, else rounded to them, or to four digits if there
    /// are that many zeros before them.
    pub(super) fn shown(self) -> String {
        let magnitude = self.numerator.abs();
        let (mut whole, mut rest) = (magnitude / self.denominator, magnitude % self.denominator);
        let mut digits: Vec<u8> = Vec::new();
        let mut significant = if whole > 0 { SIGNIFICANT } else { 0 };
        while rest != 0 && (digits.len() < DECIMALS || significant < SIGNIFICANT) {
            rest *= 10;
            let digit = (rest / self.denominator) as u8;
            rest %= self.denominator;
            significant += usize::from(significant > 0 || digit > 0);
            digits.push(digit);
        }
        let mut carry = 2 * rest >= self.denominator;
        for digit in digits.iter_mut().rev() {
            *digit = if carry { (*digit + 1) % 10 } else { *digit };
            carry &= *digit == 0;
        }
        whole += i128::from(carry);
        let sign = if self.is_negative() { "-" } else { "" };
        let point = if digits.is_empty() { "" } else { "." };
        let decimals: String = digits.iter().map(|digit| char::from(b'0' + digit)).collect();
        format!("{sign}{whole}{point}{decimals}")
    }
}

/// The greatest common divisor of two numbers from 0 on, of which one is above 0.
fn common(mut a: i128, mut b: i128) -> i128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl Mul for Exact {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        // Both are in lowest terms, so what they have in common across is all, and nothing grows beyond the result.
        let (ours, theirs) =
            (common(self.numerator.abs(), other.denominator), common(other.numerator.abs(), self.denominator));
        Exact {
            numerator: (self.numerator / ours) * (other.numerator / theirs),
            denominator: (self.denominator / theirs) * (other.denominator / ours),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(text: &str) -> Exact {
        Exact::parse(text).unwrap_or_else(|| panic!("{text}"))
    }

    #[test]
    fn numbers_are_read_exactly() {
        assert_eq!(number("51200"), Exact::whole(51_200));
        assert_eq!(number("-0.5"), Exact::ratio(-1, 2));
        assert_eq!(number("+.125"), Exact::ratio(1, 8));
        assert_eq!(number("3."), Exact::whole(3));
        assert_eq!(number("999999999999999"), Exact::whole(999_999_999_999_999_i64));
        for wrong in ["", ".", "-", "1e3", "1.2.3", "--1", "9999999999999999", "0x10", "ten", "٣"] {
            assert_eq!(Exact::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn halves_are_rounded_away_from_zero() {
        for (text, rounded) in [("0.5", 1), ("-0.5", -1), ("1.4999", 1), ("-2.5", -3), ("0.49", 0), ("7", 7)] {
            assert_eq!(number(text).rounded(), rounded, "{text}");
        }
    }

    #[test]
    fn what_is_shown_has_six_decimals_or_four_digits() {
        let thirds = Exact::ratio(2, 3);
        assert_eq!(thirds.shown(), "0.666667");
        assert_eq!((thirds * Exact::whole(-100)).shown(), "-66.666667");
        assert_eq!(Exact::ratio(1, 3_000_000).shown(), "0.0000003333");
        assert_eq!(Exact::ratio(1, 4).shown(), "0.25");
        assert_eq!(Exact::whole(0).shown(), "0");
        // Rounding carries as far as it has to.
        assert_eq!(Exact::ratio(29_999_999, 10_000_000).shown(), "3.000000");
        assert_eq!(Exact::ratio(99_999_999, 100_000_000).shown(), "1.000000");
    }
}
