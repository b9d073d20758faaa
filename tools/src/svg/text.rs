//! Texts in images.

/// Width of a character of a text with a font size of 11, about.
pub const CHARACTER: f64 = 6.6;

/// The text, cut to `room` characters.
pub fn shortened(text: &str, room: usize) -> String {
    if text.chars().count() <= room {
        return text.into();
    }
    text.chars().take(room.saturating_sub(1)).chain(['\u{2026}']).collect()
}

/// A text with XML's special characters escaped and without control characters, which XML does not allow.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            c if c.is_control() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_the_image() {
        assert_eq!(escaped("a<b>&\"\u{1b}"), "a&lt;b&gt;&amp;&quot;\u{fffd}");
        assert_eq!((shortened("Timer0Irq", 9), shortened("Timer0Irq", 6)), ("Timer0Irq".into(), "Timer…".into()));
    }
}
