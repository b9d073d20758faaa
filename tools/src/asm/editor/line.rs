//! The lines of a text, cut into tokens.

use super::super::source::{Problem, Span};
use super::super::token::{Lexer, Token};
use super::columns::Columns;

/// The character that some texts have in front of their first line; it belongs to no line.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// A line of a text.
pub(super) struct Line<'a> {
    /// The number of the line, from 0.
    pub(super) number: usize,
    /// The characters of the line.
    pub(super) text: &'a str,
    /// Number of units of UTF-16 in front of the line that are none of its characters.
    pub(super) skipped: usize,
    /// The tokens of the line, up to the first mistake.
    pub(super) tokens: Vec<Token>,
    /// The problem of characters that begin no token.
    pub(super) problem: Option<Problem>,
    /// The comments, and the parts of those that go over several lines.
    pub(super) comments: &'a [Span],
    /// Whether a comment of the line above goes on in this one.
    continues: bool,
    /// Whether its last comment goes on in the next line.
    goes_on: bool,
}

impl Line<'_> {
    /// The columns of the line.
    pub(super) fn columns(&self) -> Columns {
        Columns::of(self.text, self.skipped)
    }

    /// Whether what is written in front of this character becomes a part of a comment.
    pub(super) fn is_comment(&self, at: usize) -> bool {
        let Some(last) = self.comments.last() else { return false };
        let to_the_end = self.goes_on || self.text.chars().skip(last.start).take(2).eq("//".chars());
        (at == 0 && self.continues)
            || (at >= last.end && to_the_end)
            || self.comments.iter().any(|span| span.start < at && at < span.end)
    }
}

/// Takes all lines of a text in their order. Behind the last end of a line there is one more, as editors show it.
pub(super) fn each_line(text: &str, mut take: impl FnMut(Line<'_>)) {
    let (text, skipped) = match text.strip_prefix(BYTE_ORDER_MARK) {
        Some(text) => (text, BYTE_ORDER_MARK.len_utf16()),
        None => (text, 0),
    };
    let mut lexer = Lexer::default();
    let last = (text.is_empty() || text.ends_with('\n')).then_some("");
    for (number, text) in text.lines().chain(last).enumerate() {
        let continues = lexer.is_in_comment();
        let (tokens, problem) = lexer.line(number, text);
        let goes_on = lexer.is_in_comment();
        let skipped = if number == 0 { skipped } else { 0 };
        take(Line { number, text, skipped, tokens, problem, comments: lexer.comments(), continues, goes_on });
    }
}
