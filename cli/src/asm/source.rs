//! Source files, and places in them.

use std::path::{Path, PathBuf};

use crate::files::read_source;

/// A source file, read once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Its name as it is told: the path as it was given, or the name of a built-in file.
    pub name: String,
    /// Where it lies; a built-in file and standard input lie nowhere.
    pub path: Option<PathBuf>,
    /// Its lines, without what ends them.
    pub lines: Vec<String>,
    /// It is part of this program.
    pub built_in: bool,
}

impl Source {
    /// A source that is no file.
    pub(super) fn from_text(name: &str, text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Source { name: name.into(), path: None, lines: text.lines().map(String::from).collect(), built_in: false }
    }

    /// Reads a file.
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let source = Self::from_text(&path.display().to_string(), &read_source(path)?);
        Ok(Source { path: Some(path.into()), ..source })
    }
}

/// A part of a line, in characters from its beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Span {
    /// The first character.
    pub(super) start: usize,
    /// The character behind the last.
    pub(super) end: usize,
}

impl Span {
    pub(super) fn new(start: usize, end: usize) -> Self {
        Span { start, end }
    }

    /// From the beginning of this to the end of the other.
    pub(super) fn to(self, other: Span) -> Self {
        Span { start: self.start, end: other.end }
    }

    /// The place behind it.
    pub(super) fn behind(self) -> Self {
        Span { start: self.end, end: self.end + 1 }
    }
}

/// What is wrong with a part of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Problem {
    pub(super) span: Span,
    pub(super) message: String,
}

impl Problem {
    pub(super) fn new(span: Span, message: impl Into<String>) -> Self {
        Problem { span, message: message.into() }
    }
}
