//! What is saved in the EEPROM: the objects with a slot, in three groups (1010h, 1011h, 2706h). The settings of the TMCL
//! firmware have the same place with another tag: they count as foreign and are left alone until something is saved.
//! Program memory belongs to that firmware and is never touched.

use core::task::Poll;

use super::abort::Abort;
use super::address::Address;
use super::emcy::Emergency;
use super::object::{Entry, Object, ROWS};
use super::row::{Row, Storage};
use super::values::entries;
use super::{Node, cob, map};
use crate::device::Board;
use crate::store::{FIRST_SLOT, Finished, Layout, Memory, Need, Pair, Store, Storing};

/// The TMCM-1140 with the CANopen firmware, as a type: what its EEPROM, an AT25128, is used for.
#[derive(Clone, Copy, Debug)]
pub struct Tmcm1140;

/// The slot for the number of pages that are stored together, and for what follows the erasure of a program: there is none.
const UNUSED: usize = FIRST_SLOT;
/// The name of the layout of the TMCL firmware, which a test compares with that firmware's.
const OF_TMCL: &[u8] = b"tmcm settings 2";
/// Number of slots in use.
pub(super) const SLOTS: usize = 123;

impl Memory for Tmcm1140 {
    const SIZE: usize = 16_384;
    const PAGE: usize = 64;
    const LAYOUT: Layout = Layout {
        tag: b"tmcm canopen 1",
        defaults: const { &defaults() },
        after_erasing: UNUSED,
        other: 16,
        storing: Storing::Epochs { pages: UNUSED, other: OF_TMCL },
    };
    type Program = [u8; 0];
    type Values = [i32; 224];
    type Pairs = [Pair; 16];
}

/// The slot's value for a COB-ID that is its default: so it follows the node ID. No COB-ID is 0.
const FOLLOWS_NODE: i32 = 0;

/// The value of each slot after a factory reset. Evaluated by the compiler alone.
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

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Saves the objects of a group as they are now. Pending until they are durable.
    pub(super) fn save(&mut self, group: Group) -> Poll<()> {
        self.set_slots(group, |node, entry, _| node.saved_form(entry))
    }

    /// Restores the defaults of a group, which are in force after the next start; until then the values stay as they
    /// are. Pending until they are durable. A power cut leaves all of the defaults or none.
    pub(super) fn load_defaults(&mut self, group: Group) -> Poll<()> {
        let defaults = <Tmcm1140 as Memory>::LAYOUT.defaults;
        let store = self.device.store_mut();
        let mut slots = defaults.iter().enumerate().skip(FIRST_SLOT).filter(|(slot, _)| *slot != UNUSED);
        if group == Group::All && (store.lost() != 0 || slots.any(|(slot, default)| store.get(slot) != Some(*default)))
        {
            store.reset(false);
            return self.durable();
        }
        self.set_slots(group, |_, _, slot| defaults.get(slot).copied().unwrap_or_default())
    }

    /// Sets the slots of a group.
    fn set_slots(&mut self, group: Group, value: impl Fn(&Self, Entry, usize) -> i32) -> Poll<()> {
        for entry in entries() {
            let row = entry.row();
            if let Some(slot) = row.slot(entry.nth).filter(|_| group.contains(row)) {
                let value = value(self, entry, slot);
                // The layout has all these slots.
                let _ = self.device.store_mut().set(slot, value);
            }
        }
        if self.device.store().lost() != 0 {
            self.device.store_mut().renew();
        }
        self.durable()
    }

    /// Pending until all that was saved is durable.
    fn durable(&self) -> Poll<()> {
        if self.is_settled() { Poll::Ready(()) } else { Poll::Pending }
    }

    /// True when all that was saved is durable.
    pub fn is_settled(&self) -> bool {
        self.device.store().settled(Need::Settings)
    }

    /// The value of an object as its slot has it.
    fn saved_form(&self, entry: Entry) -> i32 {
        let (row, value) = (entry.row(), self.values.get(entry));
        if row.follows_node() && value == row.default_number(entry.nth, self.node) {
            FOLLOWS_NODE
        } else {
            value as i32
        }
    }

    /// Takes node ID and bit rate from the store; they are in force until the next start. If they are unknown there, those
    /// of before a restart are taken.
    pub(super) fn take_addresses(&mut self) {
        self.known = !self.lost.address || self.kept.is_some();
        if let Some(Address { node, bit_rate }) = self.kept.filter(|_| self.lost.address) {
            (self.node, self.bit_rate) = (node, bit_rate);
            return;
        }
        let stored = |object| {
            let row = Entry::of(object).row();
            let stored = row.slot(0).and_then(|slot| self.device.store().get(slot));
            let valid = stored.filter(|value| row.accepts((*value).into()));
            valid.map_or(row.default_number(0, 0), |value| value as u32)
        };
        (self.node, self.bit_rate) = (stored(Object::NodeId) as u8, stored(Object::BitRate) as u16);
    }

    /// Sets the objects that `which` chooses to their values in the store, and those without a slot to their defaults.
    /// A value that is impossible counts as its default.
    pub(super) fn restore(&mut self, which: impl Fn(&Row) -> bool) {
        for entry in entries().filter(|entry| which(entry.row())) {
            let row = entry.row();
            let default = row.default_number(entry.nth, self.node);
            let stored = row.slot(entry.nth).and_then(|slot| self.device.store().get(slot));
            let value = match stored {
                Some(FOLLOWS_NODE) if row.follows_node() => default,
                Some(value) if fits(entry, value as u32) => value as u32,
                Some(_) | None => default,
            };
            self.values.set(entry, value);
        }
        map::mend(&mut self.values, self.node);
    }

    /// Tells the node how the EEPROM job that it gave out last has gone. An SDO request that waits for it is answered:
    /// confirmed if all it saved is written.
    pub fn stored(&mut self, written: bool) {
        let Finished { failed, worn, answers, .. } = self.device.store_mut().finish(written);
        // A node without an address starts anew, to read it.
        if answers && !self.known {
            self.device.restart_at(self.now);
        }
        if worn {
            self.raise(Emergency::SettingsWorn);
        }
        if failed.is_some() {
            self.server.conclude(Err(Abort::Hardware));
        } else if self.is_settled() {
            self.server.conclude(Ok(()));
            // What was lost has been replaced.
            if self.device.store().lost() == 0 {
                self.lost = Default::default();
            }
        }
    }

    /// The settings on their way to the EEPROM: the caller takes jobs from here and reports how they went.
    pub fn store(&mut self) -> &mut Store<Tmcm1140> {
        self.device.store_mut()
    }
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
