//! The settings: what is durable, what is wanted, and the page writes that make the one the other.

use core::ops::Range;

use super::Report;
use super::memory::{Array, FRAME, LONGEST_PAGE, Memory, Pair};
use super::page::{self, Job};

/// The settings as they are in the EEPROM and as they shall be.
#[derive(Debug)]
pub(super) struct Settings<M: Memory> {
    durable: M::Values,
    wanted: M::Values,
    pairs: M::Pairs,
    epoch: u16,
    /// Pages that differ, as bits.
    dirty: u64,
    /// Pages of which a copy is to be written whatever is in it, as bits.
    forced: u64,
    in_flight: Option<Flight>,
    /// Nobody knows what is durable: nothing counts as such, whatever its value.
    pub(super) unreachable: bool,
}

/// A page handed out to be written. Until then its values may change again: what was handed out counts as durable then.
#[derive(Clone, Debug)]
struct Flight {
    page: usize,
    epoch: u16,
    image: page::Page,
}

/// Both copies of a page: what a factory reset writes, so that no single failing page brings old settings back,
/// and what makes a page ours.
const BOTH: u8 = 2;

impl<M: Memory> Settings<M> {
    /// Values in a page.
    const EACH: usize = (M::PAGE - FRAME) / 4;

    /// The slots of a page.
    fn slots(page: usize) -> Range<usize> {
        let first = page.saturating_mul(Self::EACH);
        first..first.saturating_add(Self::EACH)
    }

    /// Reads the settings area through `read(address, page)`.
    pub(super) fn load<E>(&mut self, mut read: impl FnMut(u16, &mut [u8]) -> Result<(), E>) -> Result<Report, E> {
        self.forget();
        let mut report = Report::default();
        let mut space = [0; LONGEST_PAGE];
        let image = space.get_mut(..M::PAGE).unwrap_or_default();
        // Until it is known which one counts, the first copies are in one array and the second ones in the other.
        for (index, pair) in self.pairs.as_mut().iter_mut().enumerate() {
            let first = self.durable.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let second = self.wanted.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let mut ours = false;
            for ((side, values), found) in [(false, first), (true, second)].into_iter().zip(&mut pair.found) {
                read(address::<M>(index, side), image)?;
                *found = page::decode(M::LAYOUT.tag, index, image, values);
                match found {
                    Some(_) => {
                        report.valid = report.valid.saturating_add(1);
                        ours = true;
                    }
                    None if image.iter().all(|byte| *byte == 0xFF) => {}
                    None => {
                        report.foreign = report.foreign.saturating_add(1);
                        pair.alien = true;
                    }
                }
            }
            pair.alien &= !ours;
        }
        self.epoch = self.find_epoch();
        for (index, pair) in self.pairs.as_mut().iter_mut().enumerate() {
            let first = self.durable.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let second = self.wanted.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let of_now = |found: Option<(u16, u8)>| found.filter(|(epoch, _)| *epoch == self.epoch);
            let [one, other] = pair.found.map(of_now);
            let second_is_newer = match (one, other) {
                (Some((_, one)), Some((_, other))) => page::follows(other, one),
                (one, _) => one.is_none(),
            };
            match if second_is_newer { other } else { one } {
                Some((_, sequence)) => {
                    pair.newest = (second_is_newer, sequence);
                    if second_is_newer {
                        copy(first, second);
                    }
                }
                None => set_defaults::<M>(first, index.saturating_mul(Self::EACH)),
            }
        }
        copy(self.wanted.as_mut(), self.durable.as_ref());
        Ok(report)
    }

    /// The epoch that counts, by what was found. Every factory reset has written the first page; the others may be so old that
    /// they look newer.
    fn find_epoch(&mut self) -> u16 {
        let epochs = |pairs: &[Pair]| {
            let epochs = pairs.iter().flat_map(|pair| pair.found).flatten().map(|(epoch, _)| epoch);
            epochs.reduce(|a, b| if page::newer(b, a) { b } else { a })
        };
        let [first, rest @ ..] = self.pairs.as_mut() else { return 0 };
        if let Some(epoch) = epochs(core::slice::from_ref(first)) {
            return epoch;
        }
        let epoch = epochs(rest).unwrap_or_default();
        // Without it only what is all of one epoch is beyond doubt.
        first.alien |= rest.iter().flat_map(|pair| pair.found).flatten().any(|(found, _)| found != epoch);
        epoch
    }

    /// Settings of which nothing is known yet, not even the defaults: they are to be [forgotten](Self::forget) first.
    pub(super) const fn new() -> Self {
        Settings {
            durable: M::Values::ZEROS,
            wanted: M::Values::ZEROS,
            pairs: M::Pairs::ZEROS,
            epoch: 0,
            dirty: 0,
            forced: 0,
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
        for values in [&mut self.wanted, &mut self.durable] {
            set_defaults::<M>(values.as_mut(), 0);
        }
        self.dirty = 0;
    }

    /// The stored value of a slot; `None` if there is no such slot.
    pub(super) fn get(&self, slot: usize) -> Option<i32> {
        if slot < M::LAYOUT.defaults.len() { self.wanted.as_ref().get(slot).copied() } else { None }
    }

    /// Wants a value in a slot. What is there already is not written again. False if there is no such slot.
    pub(super) fn set(&mut self, slot: usize, value: i32) -> bool {
        if slot >= M::LAYOUT.defaults.len() {
            return false;
        }
        let Some(place) = self.wanted.as_mut().get_mut(slot) else { return false };
        *place = value;
        self.mark(slot.checked_div(Self::EACH).unwrap_or_default());
        if !self.settled() {
            self.format();
        }
        true
    }

    /// Wants factory defaults everywhere.
    pub(super) fn reset(&mut self) {
        self.epoch = self.epoch.wrapping_add(1);
        self.default();
        if let Some(first) = self.pairs.as_mut().first_mut() {
            first.forced = BOTH;
            self.forced |= bit(0);
        }
        self.format();
    }

    /// Makes the pages ours that are not.
    fn format(&mut self) {
        for (index, pair) in self.pairs.as_mut().iter_mut().enumerate() {
            if pair.alien && pair.forced == 0 {
                pair.forced = BOTH;
                self.forced |= bit(index);
            }
        }
    }

    /// True when all that is wanted is durable. A page on its way may be about to become something else, so
    /// it counts until it is known how it went.
    pub(super) fn settled(&self) -> bool {
        self.dirty == 0 && self.forced == 0 && self.in_flight.is_none()
    }

    /// The next page to write; until [`Store::finish`] there is no other.
    pub(super) fn next_job(&mut self) -> Option<Job> {
        if self.in_flight.is_some() {
            return None;
        }
        let candidates = if self.forced == 0 { self.dirty } else { self.forced };
        if candidates == 0 {
            return None;
        }
        let index = usize::try_from(candidates.trailing_zeros()).ok()?;
        let Pair { alien, newest: (side, sequence), .. } = *self.pairs.as_ref().get(index)?;
        // What is made ours holds what it counted as before: should that fail, nothing has been stored.
        let values = page_of::<M>(if alien { &self.durable } else { &self.wanted }, index)?;
        let image = page::encode(M::LAYOUT.tag, index, self.epoch, sequence.wrapping_add(1), values);
        self.in_flight = Some(Flight { page: index, epoch: self.epoch, image: image.clone() });
        Some(Job { address: address::<M>(index, !side), page: image })
    }

    /// The page handed out last is durable; or it could not be written, and all that is not durable is given
    /// up.
    pub(super) fn finish(&mut self, written: bool) {
        let Some(Flight { page, epoch, image }) = self.in_flight.take() else { return };
        let pairs = self.pairs.as_mut();
        if !written {
            copy(self.wanted.as_mut(), self.durable.as_ref());
            pairs.iter_mut().for_each(|pair| pair.forced = 0);
            (self.dirty, self.forced) = (0, 0);
            return;
        }
        let Some(pair) = pairs.get_mut(page) else { return };
        pair.newest = (!pair.newest.0, pair.newest.1.wrapping_add(1));
        if epoch != self.epoch {
            // A factory reset came in between: what was written counts no more.
            return;
        }
        if let Some(durable) = self.durable.as_mut().get_mut(Self::slots(page)) {
            page::take_values(&image, durable);
        }
        pair.forced = pair.forced.saturating_sub(1);
        if pair.forced == 0 {
            pair.alien = false;
            self.forced &= !bit(page);
        }
        self.mark(page);
    }

    fn mark(&mut self, page: usize) {
        if page_of::<M>(&self.wanted, page) != page_of::<M>(&self.durable, page) || self.unreachable {
            self.dirty |= bit(page);
        } else {
            self.dirty &= !bit(page);
        }
    }
}

/// The values of a page.
fn page_of<M: Memory>(values: &M::Values, page: usize) -> Option<&[i32]> {
    values.as_ref().get(Settings::<M>::slots(page))
}

/// Both have the same length.
fn copy(to: &mut [i32], from: &[i32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}

/// The factory defaults of the slots from `first` on; what is no slot is 0.
fn set_defaults<M: Memory>(values: &mut [i32], first: usize) {
    values.fill(0);
    let defaults = M::LAYOUT.defaults.get(first..).unwrap_or_default();
    values.iter_mut().zip(defaults).for_each(|(value, default)| *value = *default);
}

/// Address of a page's first or second copy: at the end of the part.
fn address<M: Memory>(page: usize, second: bool) -> u16 {
    let area = M::Pairs::LENGTH.saturating_mul(2).saturating_mul(M::PAGE);
    let copy = page.saturating_mul(2).saturating_add(second.into());
    M::SIZE.saturating_sub(area).saturating_add(copy.saturating_mul(M::PAGE)) as u16
}

fn bit(page: usize) -> u64 {
    1_u64.unbounded_shl(page as u32)
}
