//! The objects whose saved values are gone, because neither copy of their page in the EEPROM can be read. They have
//! their defaults, and the drive is in FAULT until they have been written, or a save or a restore has taken their
//! place.

use super::entry::Entry;
use super::store::SLOTS;
use super::values::entries;
use crate::store::{Memory, Store};

/// Slots in a word, and words for all of them.
const BITS: usize = u32::BITS as usize;
const WORDS: usize = SLOTS.div_ceil(BITS);

/// The values that are gone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lost {
    /// The slots of these objects, one bit each.
    slots: [u32; WORDS],
    /// Node ID and bit rate are among them: then all is gone, because their page says what belongs to it.
    pub(super) address: bool,
}

impl Lost {
    /// The objects of the pages that a store has lost; all of an EEPROM that does not answer. None if all are being
    /// stored anew, which at the start are the settings of the factory, that somebody has asked for.
    pub(super) fn of<M: Memory>(store: &Store<M>) -> Self {
        if store.is_storing() {
            return Lost::default();
        }
        let address = store.is_unreachable() || store.lost() & 1 != 0;
        let lost = |slot: &usize| address || store.lost() & 1_u64.unbounded_shl(Store::<M>::page_of(*slot) as u32) != 0;
        let mut all = Lost { address, ..Lost::default() };
        for entry in entries().filter(|entry| entry.row().slot(entry.nth).as_ref().is_some_and(&lost)) {
            all.mark(entry, true);
        }
        all
    }

    /// The objects whose indices are below `end` have been restored once more: those are lost again of which there
    /// still is nothing to be restored.
    pub(super) fn lose_again<M: Memory>(&mut self, store: &Store<M>, end: u16) {
        let lost = Lost::of(store);
        for entry in entries().filter(|entry| entry.row().first < end && lost.contains(*entry)) {
            self.mark(entry, true);
        }
    }

    /// Notes whether the saved value of an object is gone.
    fn mark(&mut self, entry: Entry, gone: bool) {
        let Some(slot) = entry.row().slot(entry.nth) else { return };
        if let Some(word) = self.slots.get_mut(slot / BITS) {
            *word = *word & !bit(slot) | if gone { bit(slot) } else { 0 };
        }
    }

    pub(super) fn is_empty(self) -> bool {
        self.slots.iter().all(|word| *word == 0)
    }

    /// An object has been written.
    pub(super) fn written(&mut self, entry: Entry) {
        self.mark(entry, false);
    }

    /// True if the saved value of this object is gone.
    pub(super) fn contains(self, entry: Entry) -> bool {
        let Some(slot) = entry.row().slot(entry.nth) else { return false };
        self.slots.get(slot / BITS).is_some_and(|word| word & bit(slot) != 0)
    }

    /// The first of them, as a message names it: index and sub-index.
    pub(super) fn first(self) -> Option<(u16, u8)> {
        entries()
            .find(|entry| self.contains(*entry))
            .map(|entry| (entry.row().first.wrapping_add(entry.nth.into()), entry.row().sub))
    }
}

/// The bit of a slot in its word.
const fn bit(slot: usize) -> u32 {
    1_u32.rotate_left(slot as u32)
}
