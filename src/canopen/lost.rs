//! The objects whose saved values are gone, because neither copy of their page in the EEPROM can be read: they have their
//! defaults, and the drive is in FAULT until they have been written, or a save or a restore has taken their place.

use super::object::Entry;
use super::store::{SLOTS, Tmcm1140};
use super::values::entries;
use crate::store::Store;

/// The slots of these objects, one bit each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lost(u128);

impl Lost {
    /// The objects of the pages that a store has lost.
    pub(super) fn of(store: &Store<Tmcm1140>) -> Self {
        let lost = |slot: &usize| store.lost() & 1_u64.unbounded_shl(Store::<Tmcm1140>::page_of(*slot) as u32) != 0;
        let slots = entries().filter_map(|entry| entry.row().slot(entry.nth));
        Lost(slots.filter(lost).fold(0, |all, slot| all | bit(slot)))
    }

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// An object has been written.
    pub(super) fn written(&mut self, entry: Entry) {
        if let Some(slot) = entry.row().slot(entry.nth) {
            self.0 &= !bit(slot);
        }
    }

    /// True if the saved value of this object is gone.
    pub(super) fn contains(self, entry: Entry) -> bool {
        entry.row().slot(entry.nth).is_some_and(|slot| self.0 & bit(slot) != 0)
    }

    /// The first of them, as a message names it: index and sub-index.
    pub(super) fn first(self) -> Option<(u16, u8)> {
        entries()
            .find(|entry| self.contains(*entry))
            .map(|entry| (entry.row().first.wrapping_add(entry.nth.into()), entry.row().sub))
    }
}

const fn bit(slot: usize) -> u128 {
    const { assert!(SLOTS <= u128::BITS as usize) };
    1_u128.unbounded_shl(slot as u32)
}
