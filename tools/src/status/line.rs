//! A statement about an axis.

use serde::{Deserialize, Serialize};

/// How much a statement matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// All is as it should be.
    Fine,
    /// Something that one may want to know.
    Note,
    /// Something that keeps the motor from doing all that it may be told, or that may come to an error.
    Warning,
    /// Something has stopped the motor, or keeps it from moving.
    Error,
}

/// A statement about an axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// How much it matters.
    pub severity: Severity,
    /// The words that there are to say.
    pub words: String,
}

impl Line {
    /// All is as it should be.
    pub(super) fn fine(words: impl Into<String>) -> Self {
        Line { severity: Severity::Fine, words: words.into() }
    }

    /// Something that one may want to know.
    pub(super) fn note(words: impl Into<String>) -> Self {
        Line { severity: Severity::Note, words: words.into() }
    }

    /// Something that keeps the motor from doing all that it may be told.
    pub(super) fn warning(words: impl Into<String>) -> Self {
        Line { severity: Severity::Warning, words: words.into() }
    }

    /// Something has stopped the motor, or keeps it from moving.
    pub(super) fn error(words: impl Into<String>) -> Self {
        Line { severity: Severity::Error, words: words.into() }
    }
}
