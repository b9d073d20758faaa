//! The settings: what is durable, what is wanted, and the page writes that make the one the other.

use super::Report;
use super::layout::Slot;
use super::page::{self, Decoded, Image, Job, PAGES, Values};

/// The settings as they are in the EEPROM and as they shall be.
#[derive(Debug)]
pub(super) struct Settings {
    durable: [Values; PAGES],
    wanted: [Values; PAGES],
    /// Which copy of each page is the newest, and its sequence number.
    newest: [(bool, u8); PAGES],
    epoch: u16,
    /// Pages that differ.
    dirty: u16,
    /// How many copies of each page are to be written whatever is in them.
    forced: [u8; PAGES],
    /// Pages that hold something which is not ours, or nothing where there should be something. The first store writes over
    /// it; they are ours when both copies are written.
    alien: [bool; PAGES],
    in_flight: Option<Flight>,
    /// Nobody knows what is durable: nothing counts as such, whatever its value.
    pub(super) unreachable: bool,
}

/// A page handed out to be written.
#[derive(Clone, Copy, Debug)]
struct Flight {
    page: usize,
    epoch: u16,
    values: Values,
}

/// Both copies of a page: what a factory reset writes, so that no single failing page brings old settings back,
/// and what makes a page ours.
const BOTH: u8 = 2;

impl Settings {
    /// Reads the settings area through `read(address, page)`.
    pub(super) fn load<E>(&mut self, mut read: impl FnMut(u16, &mut Image) -> Result<(), E>) -> Result<Report, E> {
        self.forget();
        let mut report = Report::default();
        let mut found = [[None; 2]; PAGES];
        for (index, (copies, alien)) in found.iter_mut().zip(&mut self.alien).enumerate() {
            let mut ours = false;
            for (side, copy) in copies.iter_mut().enumerate() {
                let mut image: Image = [0; _];
                read(page::address(index, side != 0), &mut image)?;
                *copy = page::decode(index, &image);
                match copy {
                    Some(_) => {
                        report.valid = report.valid.saturating_add(1);
                        ours = true;
                    }
                    None if image.iter().all(|byte| *byte == 0xFF) => {}
                    None => {
                        report.foreign = report.foreign.saturating_add(1);
                        *alien = true;
                    }
                }
            }
            *alien &= !ours;
        }
        let newest = |pages: &[[Option<Decoded>; 2]]| {
            let epochs = pages.iter().flatten().flatten().map(|page| page.epoch);
            epochs.reduce(|a, b| if page::newer(b, a) { b } else { a })
        };
        // Every factory reset has written the first page. The others may be so old that they look newer.
        let ([first, ..], [alien, ..]) = (&found, &mut self.alien);
        self.epoch = newest(core::slice::from_ref(first)).unwrap_or_else(|| {
            let epoch = newest(&found).unwrap_or_default();
            // Without it only what is all of one epoch is beyond doubt.
            *alien |= found.iter().flatten().flatten().any(|page| page.epoch != epoch);
            epoch
        });
        let places = self.durable.iter_mut().zip(&mut self.newest);
        for ((values, newest), copies) in places.zip(found) {
            let [first, second] = copies.map(|copy| copy.filter(|copy| copy.epoch == self.epoch));
            let second_is_newer = match (first, second) {
                (Some(first), Some(second)) => page::follows(second.sequence, first.sequence),
                (first, _) => first.is_none(),
            };
            if let Some(copy) = if second_is_newer { second } else { first } {
                *values = copy.values;
                *newest = (second_is_newer, copy.sequence);
            }
        }
        self.wanted = self.durable;
        Ok(report)
    }

    /// Settings of which nothing is known yet, not even the defaults: they are to be [forgotten](Self::forget) first.
    pub(super) const fn new() -> Self {
        Settings {
            durable: [[0; _]; PAGES],
            wanted: [[0; _]; PAGES],
            newest: [(false, 0); PAGES],
            epoch: 0,
            dirty: 0,
            forced: [0; PAGES],
            alien: [false; PAGES],
            in_flight: None,
            unreachable: false,
        }
    }

    /// Factory defaults, as with a fresh EEPROM.
    pub(super) fn forget(&mut self) {
        *self = Self::new();
        self.default();
    }

    fn default(&mut self) {
        for slot in Slot::all() {
            if let Some(place) = slot.place().and_then(|(page, index)| self.wanted.get_mut(page)?.get_mut(index)) {
                *place = slot.default();
            }
        }
        self.durable = self.wanted;
        self.dirty = 0;
    }

    /// The stored value of a slot; `None` if there is no such slot.
    pub(super) fn get(&self, slot: Slot) -> Option<i32> {
        let (page, index) = slot.place()?;
        self.wanted.get(page)?.get(index).copied()
    }

    /// Wants a value in a slot. What is there already is not written again.
    pub(super) fn set(&mut self, slot: Slot, value: i32) {
        let Some((page, index)) = slot.place() else { return };
        if let Some(place) = self.wanted.get_mut(page).and_then(|values| values.get_mut(index)) {
            *place = value;
        }
        self.mark(page);
        if !self.settled() {
            self.format();
        }
    }

    /// Wants factory defaults everywhere.
    pub(super) fn reset(&mut self) {
        self.epoch = self.epoch.wrapping_add(1);
        self.default();
        let [first, ..] = &mut self.forced;
        *first = BOTH;
        self.format();
    }

    /// Makes the pages ours that are not.
    fn format(&mut self) {
        for (forced, alien) in self.forced.iter_mut().zip(self.alien) {
            if alien && *forced == 0 {
                *forced = BOTH;
            }
        }
    }

    /// True when all that is wanted is durable. A page on its way may be about to become something else, so
    /// it counts until it is known how it went.
    pub(super) fn settled(&self) -> bool {
        self.dirty == 0 && self.forced == [0; PAGES] && self.in_flight.is_none()
    }

    /// The next page to write; until [`Store::finish`] there is no other.
    pub(super) fn next_job(&mut self) -> Option<Job> {
        if self.in_flight.is_some() {
            return None;
        }
        let forced = self.forced.iter().position(|forced| *forced > 0);
        let index = forced.or_else(|| (0..PAGES).find(|index| self.dirty & bit(*index) != 0))?;
        // What is made ours holds what it counted as before: should that fail, nothing has been stored.
        let source = if *self.alien.get(index)? { &self.durable } else { &self.wanted };
        let values = *source.get(index)?;
        let (side, sequence) = *self.newest.get(index)?;
        self.in_flight = Some(Flight { page: index, epoch: self.epoch, values });
        Some(Job {
            address: page::address(index, !side),
            page: page::encode(index, self.epoch, sequence.wrapping_add(1), &values),
        })
    }

    /// The page handed out last is durable; or it could not be written, and all that is not durable is given
    /// up.
    pub(super) fn finish(&mut self, written: bool) {
        let Some(flight) = self.in_flight.take() else { return };
        if !written {
            self.wanted = self.durable;
            self.dirty = 0;
            self.forced = [0; PAGES];
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
        if let Some((forced, alien)) = self.forced.get_mut(flight.page).zip(self.alien.get_mut(flight.page)) {
            *forced = forced.saturating_sub(1);
            *alien &= *forced > 0;
        }
        self.mark(flight.page);
    }

    fn mark(&mut self, page: usize) {
        if self.wanted.get(page) != self.durable.get(page) || self.unreachable {
            self.dirty |= bit(page);
        } else {
            self.dirty &= !bit(page);
        }
    }
}

fn bit(page: usize) -> u16 {
    1_u16.unbounded_shl(page as u32)
}
