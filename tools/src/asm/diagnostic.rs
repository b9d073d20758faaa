//! Errors and warnings with their location in the source.

use std::fmt;

use serde::Serialize;

use super::message::Message;
use super::source::{Problem, Source, Span};
use crate::shown::shown;

/// Most errors, and most warnings, that are shown: the first few usually cause the others.
pub(super) const SHOWN: usize = 20;

/// Most characters of a source line that are shown.
const WIDEST: usize = 200;

/// Severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// The program can be assembled, but may not do what is meant.
    Warning,
    /// The program cannot be assembled.
    Error,
}

/// A part of a line in a source file, with the text of the line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Location {
    /// Name of the file.
    pub file: String,
    /// Number of the line, from 1.
    pub line: usize,
    /// Column of the part's first character, from 1.
    pub column: usize,
    /// Column of its last character.
    pub last: usize,
    /// Text of the line.
    pub text: String,
}

impl Location {
    /// The same column in units of UTF-16, in which pages and editors count; from 1 as well.
    pub fn utf16(&self, column: usize) -> usize {
        let mut characters = self.text.chars();
        // Behind the end of the line each column is one unit.
        (1..column).map(|_| characters.next().map_or(1, char::len_utf16)).sum::<usize>() + 1
    }
}

/// An error or a warning.
///
/// A diagnostic is displayed with its location and the text of the line:
///
/// ```text
/// stage.tmc:3:5: error: unknown name 'Speeed'; did you mean 'Speed'?
///     ROR 0, Speeed
///            ^^^^^^
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// The part of the source; `None` for a file that cannot be read.
    pub location: Option<Location>,
    /// The mistake and how to mend it.
    pub message: Message,
}

impl Diagnostic {
    pub(super) fn new(severity: Severity, source: &Source, line: usize, problem: Problem) -> Self {
        let Span { start, end } = problem.span;
        let text = source.lines.get(line.saturating_sub(1)).cloned().unwrap_or_default();
        let location = Location { file: source.name.clone(), line, column: start + 1, last: end.max(start + 1), text };
        Diagnostic { severity, location: Some(location), message: problem.message }
    }

    pub(super) fn without_location(message: Message) -> Self {
        Diagnostic { severity: Severity::Error, location: None, message }
    }
}

impl Diagnostic {
    /// The text in front of the word for the severity, that word, and the text behind it. A diagnostic that is about no
    /// source looks as what `tmcl` says about other files.
    pub fn parts(&self) -> (String, &'static str, String) {
        let Some(Location { file, line, column, last, text }) = &self.location else {
            return (String::new(), "tmcl:", format!(" {}", self.message));
        };
        // Of a very long line only the part around the location is shown.
        let skipped = if *column > WIDEST { column - WIDEST / 2 } else { 0 };
        let part: String = text.chars().skip(skipped).take(WIDEST).collect();
        let before: String = part.chars().take(column - 1 - skipped).collect();
        // A tab is kept in both lines, so that the caret stands below the right character.
        let before = shown(&before).chars().map(|c| if c == '\t' { '\t' } else { ' ' }).collect::<String>();
        let head = match self.severity {
            Severity::Warning => "warning:",
            Severity::Error => "error:",
        };
        let carets = "^".repeat(WIDEST.min(last + 1 - column));
        let behind = format!(" {}\n    {}\n    {before}{carets}", self.message, shown(&part));
        (format!("{file}:{line}:{column}: "), head, behind)
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (before, head, behind) = self.parts();
        write!(f, "{before}{head}{behind}")
    }
}

/// Errors and warnings in the order of the lines they concern.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostics {
    /// Number of errors.
    pub fn errors(&self) -> usize {
        self.0.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).count()
    }

    /// True when there are neither errors nor warnings.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The diagnostics that are shown: the first of them, because they usually cause the others.
    pub fn first(&self) -> &[Diagnostic] {
        self.0.get(..SHOWN).unwrap_or(&self.0)
    }

    /// The sentence for the user where there are more diagnostics than are shown.
    pub fn more(&self) -> Option<String> {
        (self.0.len() > SHOWN).then(|| format!("and more; these are the first {SHOWN}"))
    }
}

/// Displays the diagnostics one below the other, up to a limit.
impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.first().iter().enumerate() {
            write!(f, "{}{diagnostic}", if i == 0 { "" } else { "\n" })?;
        }
        match self.more() {
            Some(more) => write!(f, "\n{more}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Diagnostics {}
