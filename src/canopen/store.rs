//! The objects that are saved in the EEPROM: those with a slot, in three groups (1010h, 1011h, 2706h). Program memory
//! belongs to the TMCL firmware and is never touched.

use core::task::Poll;

use super::cia301::cob;
use super::entry::Entry;
use super::object::{Object, ROWS, Row};
use super::row::Storage;
use super::values::{Values, entries};
use crate::store::{FIRST_SLOT, Memory, Need, Store};

/// The slot for the number of pages that are stored together, and for what follows the erasure of a program: there is
/// none.
pub(crate) const UNUSED: usize = FIRST_SLOT;
/// Number of slots in use.
pub(crate) const SLOTS: usize = 123;

/// The slot's value for a COB-ID that is its default: so it follows the node ID. No COB-ID is 0.
const FOLLOWS_NODE: i32 = 0;

/// The value of each slot after a factory reset.
pub(crate) const DEFAULTS: [i32; SLOTS] = defaults();

#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects)]
const fn defaults() -> [i32; SLOTS] {
    let mut values = [0; SLOTS];
    let mut taken = [false; SLOTS];
    let mut i = 0;
    while i < ROWS.len() {
        let row = &ROWS[i];
        let mut nth = 0;
        while nth < row.count() {
            if let Some(slot) = row.slot(nth) {
                assert!(slot > UNUSED && !taken[slot], "two objects have the same slot");
                taken[slot] = true;
                values[slot] = if row.follows_node() { FOLLOWS_NODE } else { row.default_number(nth, 0) as i32 };
            }
            nth += 1;
        }
        i += 1;
    }
    values
}

/// A group of objects that are saved, or restored, together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    All,
    Motor,
    /// Bit rate and node ID.
    Communication,
}

impl Group {
    fn contains(self, row: &Row) -> bool {
        match row.storage {
            Storage::Computed | Storage::Volatile => false,
            Storage::All(_) => self == Group::All,
            Storage::Motor(_) => self != Group::Communication,
            Storage::Communication(_) => self != Group::Motor,
        }
    }
}

impl Values {
    /// Saves the objects of a group as they are now, those of the node with this ID. Pending until they are durable.
    pub(super) fn save<M: Memory>(&self, store: &mut Store<M>, group: Group, node: u8) -> Poll<()> {
        set_slots(store, group, |entry, _| self.saved_form(entry, node));
        durable(store)
    }

    /// The value of an object as its slot has it.
    fn saved_form(&self, entry: Entry, node: u8) -> i32 {
        let (row, value) = (entry.row(), self.get(entry));
        if row.follows_node() && value == row.default_number(entry.nth, node) { FOLLOWS_NODE } else { value as i32 }
    }

    /// Sets the objects whose indices are below `end` to their values in the store, and those without a slot to their
    /// defaults. A value that is impossible counts as its default.
    pub(super) fn restore<M: Memory>(&mut self, store: &Store<M>, node: u8, end: u16) {
        for entry in entries().filter(|entry| entry.row().first < end) {
            let row = entry.row();
            let default = row.default_number(entry.nth, node);
            let stored = row.slot(entry.nth).and_then(|slot| store.get(slot));
            let value = match stored {
                Some(FOLLOWS_NODE) if row.follows_node() => default,
                Some(value) if fits(entry, value as u32) => value as u32,
                Some(_) | None => default,
            };
            self.set(entry, value);
        }
        self.mend_mappings(node);
    }
}

/// Restores the defaults of a group, which are in force after the next start; until then the values stay as they are.
/// Pending until they are durable. A power cut leaves all of the defaults or none.
pub(super) fn load_defaults<M: Memory>(store: &mut Store<M>, group: Group) -> Poll<()> {
    let defaults = M::LAYOUT.defaults;
    let mut slots = defaults.iter().enumerate().skip(FIRST_SLOT).filter(|(slot, _)| *slot != UNUSED);
    if group == Group::All && (store.lost() != 0 || slots.any(|(slot, default)| store.get(slot) != Some(*default))) {
        store.reset(false);
    } else {
        set_slots(store, group, |_, slot| defaults.get(slot).copied().unwrap_or_default());
    }
    durable(store)
}

/// Sets the slots of a group.
fn set_slots<M: Memory>(store: &mut Store<M>, group: Group, value: impl Fn(Entry, usize) -> i32) {
    for entry in entries() {
        let row = entry.row();
        if let Some(slot) = row.slot(entry.nth).filter(|_| group.contains(row)) {
            // The layout has all these slots.
            let _ = store.set(slot, value(entry, slot));
        }
    }
    if store.lost() != 0 {
        store.renew();
    }
}

/// Pending until all that was saved is durable.
fn durable<M: Memory>(store: &Store<M>) -> Poll<()> {
    if store.settled(Need::Settings) { Poll::Ready(()) } else { Poll::Pending }
}

/// True if an object can have had this value when it was saved.
fn fits(entry: Entry, value: u32) -> bool {
    let row = entry.row();
    let (low, high) = row.data.range();
    let number = row.data.value(value);
    let cob = match entry.object {
        Object::SyncCobId => cob::sync(value).is_ok(),
        Object::EmergencyCobId => cob::emergency(value).is_ok(),
        Object::ReceiveCobId | Object::TransmitCobId => cob::pdo(value).is_ok(),
        _ => true,
    };
    (low..=high).contains(&number) && row.accepts(number) && cob
}
