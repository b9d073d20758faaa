//! Text that comes from elsewhere, as it may be shown.
//!
//! Such text is lines of files, names, and what a module or a simulator has answered. Characters in it that control a
//! terminal could clear its screen, change its title or show text in another order than it has. So they are shown and
//! never sent.

use std::borrow::Cow;
use std::fmt::Write;

/// A text in which characters that control terminals are shown by their numbers, as JSON writes them: `\u001b` for ESC.
/// A line of JSON says the same as before. Ends of lines and tabs stay.
pub fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(controls) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match controls(c) {
            // Writing to a string cannot fail.
            true => _ = write!(shown, "\\u{:04x}", u32::from(c)),
            false => shown.push(c),
        }
    }
    Cow::Owned(shown)
}

/// Whether a character controls a terminal: the codes of C0 and C1, and those that change the direction of text.
fn controls(c: char) -> bool {
    let turns = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || c.is_control() && c != '\n' && c != '\t'
}
