//! Notes what reaches a virtual module, and when, so that it can be done again.

use hal_sim::clock::Nanos;

use super::MOST_DEEDS;
use super::deed::{Deed, What};

/// The deeds that have reached a module since it was started.
#[derive(Debug, Default)]
pub struct Journal {
    deeds: Vec<Deed>,
    /// True if there was more than fits.
    is_full: bool,
}

impl Journal {
    /// Notes something that is done now.
    pub fn note(&mut self, at: Nanos, what: What) {
        if self.deeds.len() < MOST_DEEDS {
            self.deeds.push(Deed { at, what });
        } else {
            self.is_full = true;
        }
    }

    /// All of it as texts.
    ///
    /// # Errors
    /// There was more than fits.
    pub fn texts(&self) -> Result<Vec<String>, String> {
        if self.is_full {
            return Err(format!(
                "this module has been told more than {MOST_DEEDS} things since it was started, and a session has no more: \
                 start it anew, or write 'restart'"
            ));
        }
        Ok(self.deeds.iter().map(Deed::to_string).collect())
    }
}
