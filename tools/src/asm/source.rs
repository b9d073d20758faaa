//! Source files, and parts of their lines.

use std::path::{Path, PathBuf};

use super::message::Message;
use crate::sources::Sources;

/// A source file, read once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Name in messages: the path as the user gave it, or the name of a built-in file.
    pub name: String,
    /// Path of the file; `None` for a built-in file and standard input.
    pub path: Option<PathBuf>,
    /// The lines, without their line ends.
    pub lines: Vec<String>,
    /// True for a file that is built into the assembler.
    pub built_in: bool,
}

impl Source {
    /// A source made of a text instead of a file.
    pub(super) fn from_text(name: &str, text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Source { name: name.into(), path: None, lines: text.lines().map(String::from).collect(), built_in: false }
    }

    /// Reads a file.
    pub(super) fn read(sources: &dyn Sources, path: &Path) -> Result<Self, String> {
        let source = Self::from_text(&path.display().to_string(), &sources.read(path)?);
        Ok(Source { path: Some(path.into()), ..source })
    }
}

/// The path of a file that a file with this path includes under this name: it is beside that one.
pub(super) fn beside(including: Option<&Path>, name: &str) -> PathBuf {
    // Sources written on Windows have backslashes in their paths.
    let relative = name.replace('\\', "/");
    including.and_then(Path::parent).unwrap_or(Path::new("")).join(relative)
}

/// A part of a line, in characters from the beginning of the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Span {
    /// Index of the first character.
    pub(super) start: usize,
    /// Index of the character behind the last one.
    pub(super) end: usize,
}

impl Span {
    pub(super) fn new(start: usize, end: usize) -> Self {
        Span { start, end }
    }

    /// The span from the beginning of this one to the end of the other.
    pub(super) fn to(self, other: Span) -> Self {
        Span { start: self.start, end: other.end }
    }

    /// The span of the one character behind this span.
    pub(super) fn behind(self) -> Self {
        Span { start: self.end, end: self.end + 1 }
    }
}

/// A mistake in a part of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Problem {
    pub(super) span: Span,
    pub(super) message: Message,
}

impl Problem {
    pub(super) fn new(span: Span, message: impl Into<Message>) -> Self {
        Problem { span, message: message.into() }
    }
}
