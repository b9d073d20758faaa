//! Reading and writing times such as `10 s`.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};

/// Units of time; a name that ends with another one comes before that.
const UNITS: [(&str, Nanos); 5] =
    [("min", 60 * SECOND), ("ms", MILLISECOND), ("us", MICROSECOND), ("s", SECOND), ("h", 3600 * SECOND)];
/// Longest time that is accepted; a longer one is a mistake, because its simulation would take hours.
const LONGEST: Nanos = 1000 * 3600 * SECOND;

/// Reads a time such as `10 s` or `500ms`.
///
/// # Errors
/// A message that says how one is written.
pub fn parse(text: &str) -> Result<Nanos, String> {
    let text = text.trim();
    let unit = UNITS.iter().find_map(|(name, unit)| Some((text.strip_suffix(name)?.trim_end(), *unit)));
    let time = unit.and_then(|(number, unit)| Some(number.parse::<f64>().ok()? * unit as f64));
    match time {
        Some(time) if time < 0.0 || time > LONGEST as f64 => Err(format!("'{text}' is not within 0 s and 1000 h")),
        Some(time) if time.is_finite() => Ok(time.round() as Nanos),
        _ => Err(format!("'{text}' is no time; give a number and a unit: us, ms, s, min or h, for example '10 s'")),
    }
}

/// A time in milliseconds or seconds, to the microsecond.
pub(super) fn show(time: Nanos) -> String {
    let (unit, name) = if time < SECOND { (MILLISECOND, "ms") } else { (SECOND, "s") };
    let digits = if time < SECOND { 3 } else { 6 };
    let number = format!("{:.digits$}", time as f64 / unit as f64);
    format!("{} {name}", number.trim_end_matches('0').trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_unit() {
        let times = ["10 s", "500ms", " 1.5 min ", "250 us", "2h", "0 s"].map(|text| parse(text).unwrap());
        let expected = [10 * SECOND, 500 * MILLISECOND, 90 * SECOND, 250 * MICROSECOND, 7200 * SECOND, 0];
        assert_eq!(times, expected);
        for wrong in ["10", "s", "", "ten s", "nan s", "-1 s", "1001 h", "10 sec", "inf h"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_are_shown_in_a_unit_that_suits_them() {
        let shown = [0, 12_345_678, 500 * MILLISECOND, 10 * SECOND, 90_000_500 * MICROSECOND].map(show);
        assert_eq!(shown, ["0 ms", "12.346 ms", "500 ms", "10 s", "90.0005 s"]);
    }
}
