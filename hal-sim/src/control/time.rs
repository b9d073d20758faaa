//! Spans of time as people write them: `20 ms`, `1.5 s`, `500us`. The control protocol and the scenario files share
//! them.

use crate::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};

/// The units, and how long each is in nanoseconds. A span without one of them is refused.
const UNITS: [(&str, Nanos); 5] =
    [("us", MICROSECOND), ("ms", MILLISECOND), ("s", SECOND), ("min", 60 * SECOND), ("h", LONGEST)];
/// The longest span: an hour.
const LONGEST: Nanos = 3600 * SECOND;

/// Reads a span of time, which is all of `text`: a number that is not negative, and a unit, with or without a space
/// between them. It is rounded to whole nanoseconds.
///
/// # Errors
/// What is wrong with it, and what to write instead: no number, no unit, a negative span, or one above an hour.
pub fn span(text: &str) -> Result<Nanos, String> {
    let text = text.trim();
    let unit_at = text.find(|character: char| character.is_ascii_alphabetic() || character == '\u{b5}');
    let (number, unit) = text.split_at(unit_at.unwrap_or(text.len()));
    let number = number.trim_end();
    let Ok(count) = number.parse::<f64>() else {
        return Err(format!("'{text}' is not a time; write a number and a unit, such as '20 ms'"));
    };
    if unit.is_empty() {
        return Err(format!("time '{text}' has no unit; write '{text} ms' or another of: {}", names()));
    }
    let Some((_, length)) = UNITS.iter().find(|(name, _)| *name == unit) else {
        return Err(format!("'{unit}' is not a unit of time; there are: {}", names()));
    };
    if count < 0.0 {
        return Err(format!("time '{text}' is negative; write how much time is to pass, such as '20 ms'"));
    }
    let nanos = count * *length as f64;
    if nanos > LONGEST as f64 {
        return Err(format!("time '{text}' is too long; an hour, '1 h', is the longest"));
    }
    Ok(nanos.round() as Nanos)
}

/// Reads the span of time with which `words` begin, in one word or in two, and gives the words behind it.
///
/// # Errors
/// As [`span`] has them.
pub fn leading_span<'a, 'b>(words: &'a [&'b str]) -> Result<(Nanos, &'a [&'b str]), String> {
    match *words {
        [] => Err("a time is missing; write a number and a unit, such as '20 ms'".into()),
        // The number stands alone: its unit is the word behind it.
        [number, unit, ref rest @ ..] if number.parse::<f64>().is_ok() => {
            Ok((span(&format!("{number} {unit}"))?, rest))
        }
        [word, ref rest @ ..] => Ok((span(word)?, rest)),
    }
}

/// The names of the units.
fn names() -> String {
    UNITS.map(|(name, _)| name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_have_a_number_and_a_unit() {
        let spans = [
            ("20 ms", 20 * MILLISECOND),
            ("1.5 s", 1500 * MILLISECOND),
            ("500us", 500 * MICROSECOND),
            (" 2   min ", 120 * SECOND),
            ("1h", LONGEST),
            ("60 min", LONGEST),
            ("0 s", 0),
            ("2.5ms", 2500 * MICROSECOND),
            ("0.0000004 ms", 0),
            ("0.3 us", 300),
            (".5 s", 500 * MILLISECOND),
        ];
        for (text, expected) in spans {
            assert_eq!(span(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn errors_say_what_to_write() {
        let errors = [
            ("", "'' is not a time; write a number and a unit, such as '20 ms'"),
            ("soon", "'soon' is not a time; write a number and a unit, such as '20 ms'"),
            ("ms", "'ms' is not a time; write a number and a unit, such as '20 ms'"),
            ("inf s", "'inf s' is not a time; write a number and a unit, such as '20 ms'"),
            ("1e3 ms", "'e3 ms' is not a unit of time; there are: us, ms, s, min, h"),
            ("20", "time '20' has no unit; write '20 ms' or another of: us, ms, s, min, h"),
            ("20 sec", "'sec' is not a unit of time; there are: us, ms, s, min, h"),
            ("20 \u{b5}s", "'\u{b5}s' is not a unit of time; there are: us, ms, s, min, h"),
            ("-1 s", "time '-1 s' is negative; write how much time is to pass, such as '20 ms'"),
            ("61 min", "time '61 min' is too long; an hour, '1 h', is the longest"),
        ];
        for (text, error) in errors {
            assert_eq!(span(text), Err(error.into()), "{text}");
        }
    }

    #[test]
    fn a_span_takes_one_word_or_two() {
        assert_eq!(leading_span(&["2.5", "ms", "power", "off"]), Ok((2500 * MICROSECOND, &["power", "off"][..])));
        assert_eq!(leading_span(&["2.5ms", "power", "off"]), Ok((2500 * MICROSECOND, &["power", "off"][..])));
        assert_eq!(leading_span(&["1", "h"]), Ok((LONGEST, &[][..])));
        assert!(leading_span(&["2.5", "power", "off"]).unwrap_err().contains("'power' is not a unit"));
        assert!(leading_span(&["2.5", "sk"]).unwrap_err().contains("'sk' is not a unit"));
        assert!(leading_span(&["2.5"]).unwrap_err().contains("'2.5' has no unit"));
        assert!(leading_span(&["-1", "s"]).unwrap_err().contains("negative"));
        assert!(leading_span(&[]).unwrap_err().contains("missing"));
    }
}
