//! How often something has been stored.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use hal_sim::chip::at25::Backing;

/// Counts how often a page of an EEPROM is written.
#[derive(Clone, Debug, Default)]
pub struct Writes(Arc<AtomicU32>);

impl Writes {
    /// How often.
    pub fn count(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }
}

impl Backing for Writes {
    fn keep(&mut self, _: &[u8]) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed);
        true
    }
}
