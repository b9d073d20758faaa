//! Messages about mistakes, and what to do about them.

use std::fmt;

use serde::Serialize;
use tmcm::tmcl::text;
use tmcm_sim::suggest::nearest;

/// A mistake in words, and what to do about it. It is displayed as one sentence.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Message {
    /// The mistake, in words.
    pub words: String,
    /// The advice on what to do about it, where that does not go without saying.
    pub advice: Option<Advice>,
}

/// Advice on what to do about a mistake.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Advice {
    /// In words.
    Words(String),
    /// The name that is probably meant in place of what is written there.
    Name(String),
}

impl Message {
    /// A message about a mistake, without advice.
    pub(super) fn new(words: impl Into<String>) -> Self {
        Message { words: words.into(), advice: None }
    }

    /// The same with advice.
    pub(super) fn advise(self, advice: impl Into<String>) -> Self {
        Message { advice: Some(Advice::Words(advice.into())), ..self }
    }

    /// The same with the name that `word` resembles, if there is one.
    pub(super) fn suggest<'a>(self, word: &str, names: impl Iterator<Item = &'a str>) -> Self {
        Message { advice: nearest(word, names).map(|name| Advice::Name(name.into())), ..self }
    }
}

impl From<String> for Message {
    fn from(words: String) -> Self {
        Message::new(words)
    }
}

impl From<&str> for Message {
    fn from(words: &str) -> Self {
        Message::new(words)
    }
}

/// How a command is used is advice.
impl From<text::Error<'_>> for Message {
    fn from(error: text::Error<'_>) -> Self {
        let message = Message::new(format!("{error:#}"));
        match error.usage() {
            Some(usage) => message.advise(format!("usage: {usage}")),
            None => message,
        }
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.advice {
            Some(advice) => write!(f, "{}; {advice}", self.words),
            None => f.write_str(&self.words),
        }
    }
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Advice::Words(words) => f.write_str(words),
            Advice::Name(name) => write!(f, "did you mean '{name}'?"),
        }
    }
}
