//! Errors and warnings: where, what, and how to mend it.

use std::fmt;

use super::source::{Problem, Source, Span};

/// So many errors, and so many warnings, are shown; the first few tell what is wrong.
pub(super) const SHOWN: usize = 20;

/// More characters of a line are not shown.
const WIDEST: usize = 200;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The program can be assembled, but may not do what is meant.
    Warning,
    /// The program cannot be assembled.
    Error,
}

/// A place in a source file, with the line it is in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    /// Number of characters.
    pub length: usize,
    /// The line.
    pub text: String,
}

/// One error or warning.
///
/// It is displayed with its place and its line:
///
/// ```text
/// stage.tmc:3:5: error: unknown name 'Speeed'; did you mean 'Speed'?
///     ROR 0, Speeed
///            ^^^^^^
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// Where; a file that cannot be read has no place.
    pub location: Option<Location>,
    /// What is wrong and how to mend it.
    pub message: String,
}

impl Diagnostic {
    pub(super) fn new(severity: Severity, source: &Source, line: usize, problem: Problem) -> Self {
        let Span { start, end } = problem.span;
        let text = source.lines.get(line.saturating_sub(1)).cloned().unwrap_or_default();
        let length = end.saturating_sub(start).max(1);
        let location = Location { file: source.name.clone(), line, column: start + 1, length, text };
        Diagnostic { severity, location: Some(location), message: problem.message }
    }

    pub(super) fn without_place(message: String) -> Self {
        Diagnostic { severity: Severity::Error, location: None, message }
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        let Some(Location { file, line, column, length, text }) = &self.location else {
            return write!(f, "{severity}: {}", self.message);
        };
        writeln!(f, "{file}:{line}:{column}: {severity}: {}", self.message)?;
        // Control characters must not reach the terminal; a tab does, in both lines, so that the caret is right.
        let shown = |c: char| if c.is_control() && c != '\t' { '\u{fffd}' } else { c };
        // Of a very long line the part around the place.
        let skipped = if *column > WIDEST { column - WIDEST / 2 } else { 0 };
        let line: String = text.chars().skip(skipped).take(WIDEST).map(shown).collect();
        let before = text.chars().take(column - 1).skip(skipped).map(|c| if c == '\t' { '\t' } else { ' ' });
        write!(f, "    {line}\n    {}{}", before.collect::<String>(), "^".repeat(WIDEST.min(*length)))
    }
}

/// Errors and warnings in the order of the lines they concern.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostics {
    /// How many errors there are.
    pub fn errors(&self) -> usize {
        self.0.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).count()
    }

    /// True when there is nothing to say.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// One below the other; of many only the first.
impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.0.iter().take(SHOWN).enumerate() {
            write!(f, "{}{diagnostic}", if i == 0 { "" } else { "\n" })?;
        }
        match self.0.len() > SHOWN {
            true => write!(f, "\nand more; these are the first {SHOWN}"),
            false => Ok(()),
        }
    }
}

impl std::error::Error for Diagnostics {}
