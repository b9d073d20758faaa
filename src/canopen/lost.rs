//! The objects whose saved values are gone, because neither copy of their page in the EEPROM can be read: they have their
//! defaults, and the drive is in FAULT until they have been written, or a save or a restore has taken their place.

use super::object::Entry;
use super::store::{SLOTS, Tmcm1140};
use super::values::entries;
use crate::store::Store;

/// Slots in a word, and words for all of them.
const BITS: usize = u32::BITS as usize;
const WORDS: usize = SLOTS.div_ceil(BITS);

/// What is gone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lost {
    /// The slots of these objects, one bit each.
    slots: [u32; WORDS],
    /// Node ID and bit rate are among them: then all is gone, because their page says what belongs to it.
    pub(super) address: bool,
}

impl Lost {
    /// The objects of the pages that a store has lost; all of an EEPROM that does not answer. None if all are being stored
    /// anew, which at the start are the settings of the factory, that somebody has asked for.
    pub(super) fn of(store: &Store<Tmcm1140>) -> Self {
        if store.is_storing() {
            return Lost::default();
        }
        let address = store.is_unreachable() || store.lost() & 1 != 0;
        let lost =
            |slot: &usize| address || store.lost() & 1_u64.unbounded_shl(Store::<Tmcm1140>::page_of(*slot) as u32) != 0;
        let mut slots = [0; WORDS];
        for slot in entries().filter_map(|entry| entry.row().slot(entry.nth)).filter(lost) {
            if let Some(word) = slots.get_mut(slot / BITS) {
                *word |= bit(slot);
            }
        }
        Lost { slots, address }
    }

    pub(super) fn is_empty(self) -> bool {
        self.slots.iter().all(|word| *word == 0)
    }

    /// An object has been written.
    pub(super) fn written(&mut self, entry: Entry) {
        if let Some(slot) = entry.row().slot(entry.nth)
            && let Some(word) = self.slots.get_mut(slot / BITS)
        {
            *word &= !bit(slot);
        }
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
