//! What survives power-off: the settings in the last 2 048 bytes of the EEPROM.
//!
//! A setting has a [`Slot`]; 14 slots make a page of 64 bytes. Each page exists twice and the two copies are
//! written in turn, with a sequence number and a CRC: a write cut short leaves the older copy. A factory
//! reset is one page write, too: it begins a new epoch, and pages of an older one count no more.
//!
//! Nothing in here touches the part. [`Store`] knows what is durable and what is wanted, and hands out page
//! writes one at a time; the [`Keeper`] carries them out beside everything else.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod keeper;
mod layout;
mod page;

pub use keeper::Keeper;
pub use layout::{AXES_MAX, Slot};
pub use page::{Job, PAGES, SETTINGS};

use page::{Image, Values};

/// What was found in the EEPROM at start-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Page copies that hold settings of ours.
    pub valid: u8,
    /// Page copies that hold something else: another firmware's data, or a write cut short.
    pub foreign: u8,
    /// The part does not answer.
    pub unreachable: bool,
}

/// The settings as they are in the EEPROM and as they shall be.
#[derive(Debug)]
pub struct Store {
    durable: [Values; PAGES],
    wanted: [Values; PAGES],
    /// Which copy of each page is the newest, and its sequence number.
    newest: [(bool, u8); PAGES],
    epoch: u16,
    /// Pages that differ.
    dirty: u16,
    /// Copies of page 0 a factory reset still has to write.
    resetting: u8,
    in_flight: Option<Flight>,
    /// Nobody knows what is durable.
    unreachable: bool,
}

/// A page handed out to be written.
#[derive(Clone, Copy, Debug)]
struct Flight {
    page: usize,
    epoch: u16,
    values: Values,
}

/// Copies of page 0 that a factory reset writes: both, so that no single failing page brings old settings
/// back.
const RESET_WRITES: u8 = 2;

impl Store {
    /// Reads the settings area through `read(address, page)`. Pages that are not ours, or damaged, are left
    /// alone and count as factory defaults.
    pub fn load<E>(mut read: impl FnMut(u16, &mut Image) -> Result<(), E>) -> Result<(Self, Report), E> {
        let mut store = Self::empty();
        let mut report = Report::default();
        let mut found = [[None; 2]; PAGES];
        for (index, copies) in found.iter_mut().enumerate() {
            for (side, copy) in copies.iter_mut().enumerate() {
                let mut image: Image = [0; _];
                read(page::address(index, side != 0), &mut image)?;
                *copy = page::decode(index, &image);
                match copy {
                    Some(_) => report.valid = report.valid.saturating_add(1),
                    None if image.iter().all(|byte| *byte == 0xFF) => {}
                    None => report.foreign = report.foreign.saturating_add(1),
                }
            }
        }
        let epochs = found.iter().flatten().flatten().map(|page| page.epoch);
        store.epoch = epochs.reduce(|a, b| if page::newer(b, a) { b } else { a }).unwrap_or_default();
        let places = store.durable.iter_mut().zip(&mut store.newest);
        for ((values, newest), copies) in places.zip(found) {
            let [first, second] = copies.map(|copy| copy.filter(|copy| copy.epoch == store.epoch));
            let second_is_newer = match (first, second) {
                (Some(first), Some(second)) => page::follows(second.sequence, first.sequence),
                (first, _) => first.is_none(),
            };
            if let Some(copy) = if second_is_newer { second } else { first } {
                *values = copy.values;
                *newest = (second_is_newer, copy.sequence);
            }
        }
        store.wanted = store.durable;
        Ok((store, report))
    }

    /// A store that reads as factory defaults, as with a fresh EEPROM.
    pub fn empty() -> Self {
        let mut defaults = [Values::default(); PAGES];
        for slot in Slot::all() {
            if let Some(place) = slot.place().and_then(|(page, index)| defaults.get_mut(page)?.get_mut(index)) {
                *place = slot.default();
            }
        }
        Store {
            durable: defaults,
            wanted: defaults,
            newest: [(false, 0); PAGES],
            epoch: 0,
            dirty: 0,
            resetting: 0,
            in_flight: None,
            unreachable: false,
        }
    }

    /// The same for a part that does not answer: nothing counts as durable, whatever its value.
    pub fn unreachable() -> Self {
        Store { unreachable: true, ..Self::empty() }
    }

    /// The stored value of a slot; `None` if there is no such slot.
    pub fn get(&self, slot: Slot) -> Option<i32> {
        let (page, index) = slot.place()?;
        self.wanted.get(page)?.get(index).copied()
    }

    /// Wants a value in a slot. What is there already is not written again.
    pub fn set(&mut self, slot: Slot, value: i32) {
        let Some((page, index)) = slot.place() else { return };
        if let Some(place) = self.wanted.get_mut(page).and_then(|values| values.get_mut(index)) {
            *place = value;
        }
        self.mark(page);
    }

    /// Wants factory defaults everywhere.
    pub fn reset(&mut self) {
        *self = Store {
            epoch: self.epoch.wrapping_add(1),
            resetting: RESET_WRITES,
            in_flight: self.in_flight,
            newest: self.newest,
            unreachable: self.unreachable,
            ..Self::empty()
        };
    }

    /// True when all that is wanted is durable. A page on its way may be about to become something else, so
    /// it counts until it is known how it went.
    pub fn settled(&self) -> bool {
        self.dirty == 0 && self.resetting == 0 && self.in_flight.is_none()
    }

    /// The next page to write; until [`Store::finish`] there is no other.
    pub fn next_job(&mut self) -> Option<Job> {
        if self.in_flight.is_some() {
            return None;
        }
        let index = if self.resetting > 0 { 0 } else { usize::try_from(self.dirty.trailing_zeros()).ok()? };
        let values = *self.wanted.get(index)?;
        let (side, sequence) = *self.newest.get(index)?;
        self.in_flight = Some(Flight { page: index, epoch: self.epoch, values });
        Some(Job {
            address: page::address(index, !side),
            page: page::encode(index, self.epoch, sequence.wrapping_add(1), &values),
        })
    }

    /// The page handed out last is durable, or could not be written. In the latter case all that is not
    /// durable is given up, so that what is stored and what reads as stored stay the same.
    pub fn finish(&mut self, written: bool) {
        let Some(flight) = self.in_flight.take() else { return };
        if !written {
            self.wanted = self.durable;
            self.dirty = 0;
            self.resetting = 0;
            return;
        }
        if let Some(newest) = self.newest.get_mut(flight.page) {
            *newest = (!newest.0, newest.1.wrapping_add(1));
        }
        if flight.epoch != self.epoch {
            // A factory reset came in between: what was written counts no more.
            return;
        }
        if let Some(durable) = self.durable.get_mut(flight.page) {
            *durable = flight.values;
        }
        self.resetting = self.resetting.saturating_sub(1);
        self.mark(flight.page);
    }

    fn mark(&mut self, page: usize) {
        let Some(bit) = u32::try_from(page).ok().and_then(|page| 1_u16.checked_shl(page)) else { return };
        if self.wanted.get(page) == self.durable.get(page) && !self.unreachable {
            self.dirty &= !bit;
        } else {
            self.dirty |= bit;
        }
    }
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects)]
mod tests;
