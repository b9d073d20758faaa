//! The settings: the values durable in the EEPROM, the wanted values, and the page writes that make the wanted values
//! durable.

use core::ops::Range;

use super::LoadReport;
use super::copies::{address, bit, is_other, second_is_newer};
use super::epochs::{Epochs, Step};
use super::memory::{Array, FRAME, LONGEST_PAGE, Memory, Pair, Storing};
use super::page::{self, Job};

/// The settings as they are in the EEPROM and as they are wanted.
#[derive(Debug)]
pub(super) struct Settings<M: Memory> {
    durable: M::Values,
    wanted: M::Values,
    pairs: M::Pairs,
    epoch: u16,
    /// Pages, one bit each, whose wanted values differ from the durable ones.
    dirty: u64,
    /// Pages, one bit each, to be written even if their values are right already.
    forced: u64,
    /// Pages before the settings that are still to be cleared, because another layout has left something there.
    strange: u8,
    /// Of the first two of these pages the second is to be cleared first.
    second_first: bool,
    /// True if the pages before the settings are to be cleared now. As long as there are any, nothing else is written.
    clearing: bool,
    /// The knowledge about pages that are stored together.
    pub(super) epochs: Epochs,
    in_flight: Option<Flight>,
    /// The EEPROM does not answer, so that its values are unknown: a value set counts as not durable even if it is
    /// equal to the durable one assumed here.
    pub(super) unreachable: bool,
}

/// A page handed out to be written. Wanted values may change while the page is being written; when the write has
/// ended, the values of `image` become the durable ones.
#[derive(Clone, Debug)]
struct Flight {
    page: usize,
    epoch: u16,
    image: page::Page,
}

/// The work that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// The write of values that are to be stored.
    Values,
    /// The write of a second copy.
    Spare,
    /// The question whether the EEPROM answers.
    Question,
}

/// Copies to write when a page is formatted, or begins a new epoch: both, so that one failing copy does not bring old
/// settings back.
const BOTH: u8 = 2;

/// The value that the bytes of a page get when it is cleared. An erased EEPROM has another one, so the page does not
/// look like one that has never been written.
const CLEARED: u8 = 0;

impl<M: Memory> Settings<M> {
    /// Number of values in a page.
    const EACH: usize = (M::PAGE - FRAME) / 4;
    /// Pages that the other layout has before those of this one.
    const BEYOND: u8 = (2 * M::LAYOUT.other.saturating_sub(M::Pairs::LENGTH)) as u8;
    /// The settings page that lies where the other layout has its first one.
    const FIRST_OF_OTHER: usize = M::Pairs::LENGTH.saturating_sub(M::LAYOUT.other);

    /// The slot for the number of pages that are stored together; `None` if each is stored by itself.
    const TOGETHER: Option<usize> = match M::LAYOUT.storing {
        Storing::Epochs { pages, .. } => Some(pages),
        Storing::Pages => None,
    };
    /// Each page is written twice.
    pub(super) const TWICE: bool = Self::TOGETHER.is_some();
    /// Pages in use.
    const USED: usize = M::LAYOUT.defaults.len().div_ceil(Self::EACH);

    /// The page of a slot.
    pub(super) fn page_of_slot(slot: usize) -> usize {
        slot.checked_div(Self::EACH).unwrap_or_default()
    }

    /// The slots of a page.
    fn slots(page: usize) -> Range<usize> {
        let first = page.saturating_mul(Self::EACH);
        first..first.saturating_add(Self::EACH)
    }

    /// Reads the settings pages from the EEPROM through `read(address, page)`.
    pub(super) fn load<E>(&mut self, mut read: impl FnMut(u16, &mut [u8]) -> Result<(), E>) -> Result<LoadReport, E> {
        self.forget();
        let mut report = LoadReport::default();
        let mut space = [0; LONGEST_PAGE];
        let image = space.get_mut(..M::PAGE).unwrap_or_default();
        let (mut lost, mut foreign, mut bad) = (false, false, 0);
        // Until it is known which copy of each page counts, `durable` holds the first copies and `wanted` the second
        // ones: there is no RAM for a third array.
        // Of pages that are stored together those behind the last one in use are never written.
        let read_pages = if Self::TWICE { Self::USED } else { M::Pairs::LENGTH };
        for (index, pair) in self.pairs.as_mut().iter_mut().enumerate().take(read_pages) {
            let first = self.durable.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let second = self.wanted.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let (mut formatted, mut heads) = (false, [None; 2]);
            for (((side, values), found), head) in
                [(false, first), (true, second)].into_iter().zip(&mut pair.found).zip(&mut heads)
            {
                read(address::<M>(index, side), image)?;
                *head = page::head(image);
                *found = page::decode(M::LAYOUT.tag, index, image, values);
                if found.is_some() {
                    report.valid = report.valid.saturating_add(1);
                    formatted = true;
                } else if head.is_some() {
                    report.foreign = report.foreign.saturating_add(1);
                    pair.unformatted = true;
                    // What the other firmware has left is not bad.
                    let other = is_other::<M>(index, image);
                    foreign |= other && index == 0;
                    bad |= if other { 0 } else { bit(index) };
                }
            }
            pair.unformatted &= !formatted;
            // Of two copies that are another layout's the older one is written first: until the newer one is gone, too,
            // that layout has its settings.
            pair.newest.0 = !formatted && second_is_newer(heads);
            lost |= index == 0 && !formatted && heads.iter().all(Option::is_some);
        }
        self.look_beyond(&mut read, image)?;
        let founded = self.pairs.as_ref().first().is_some_and(|pair| pair.found.iter().any(Option::is_some));
        // Pages of this layout are there, and the first one is not, which says how many there are.
        let headless = Self::TWICE && !founded && bad & bit(0) != 0 && !foreign && report.valid > 0;
        lost |= headless;
        self.epoch = self.find_epoch(lost);
        self.epochs = Epochs::after(self.epoch, founded);
        self.epochs.lost = if headless { bit(0) } else { 0 };
        for (index, pair) in self.pairs.as_mut().iter_mut().enumerate() {
            let first = self.durable.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let second = self.wanted.as_mut().get_mut(Self::slots(index)).unwrap_or_default();
            let of_now = |found: Option<(u16, u8)>| found.filter(|(epoch, _)| *epoch == self.epoch);
            let copies = pair.found.map(of_now);
            let [one, other] = copies;
            let take_second = second_is_newer(copies);
            match if take_second { other } else { one } {
                Some((_, sequence)) => {
                    pair.newest = (take_second, sequence);
                    if take_second {
                        copy(first, second);
                    }
                }
                None => set_defaults::<M>(first, index.saturating_mul(Self::EACH)),
            }
        }
        copy(self.wanted.as_mut(), self.durable.as_ref());
        if let Some(slot) = Self::TOGETHER {
            self.count_copies(slot, bad);
        }
        (report.lost, report.worn) = (self.epochs.lost, self.epochs.worn);
        Ok(report)
    }

    /// Looks whether each page of the epoch in force is there, twice. `bad` are the pages of which a copy is no page at
    /// all.
    fn count_copies(&mut self, slot: usize, bad: u64) {
        let pages = usize::try_from(self.get(slot).unwrap_or_default()).unwrap_or_default();
        let mut single = 0;
        for (index, pair) in self.pairs.as_ref().iter().enumerate().take(pages) {
            match pair.found.iter().flatten().filter(|(epoch, _)| *epoch == self.epoch).count() {
                0 => self.epochs.lost |= bit(index),
                1 => single |= bit(index),
                _ => {}
            }
        }
        self.epochs.worn = single & bad != 0;
        self.epochs.repeat(single);
    }

    /// Finds out what another layout has left in the pages before the settings, through `read` into `image`.
    fn look_beyond<E>(
        &mut self,
        mut read: impl FnMut(u16, &mut [u8]) -> Result<(), E>,
        image: &mut [u8],
    ) -> Result<(), E> {
        let mut heads = [None; 2];
        for number in 0..Self::BEYOND {
            read(Self::beyond(number), image)?;
            if let Some(head) = heads.get_mut(usize::from(number)) {
                *head = page::head(image);
            }
            if page::head(image).is_some() && image.iter().any(|byte| *byte != CLEARED) {
                self.strange = Self::BEYOND;
            }
        }
        self.second_first = Self::BEYOND > 0 && !second_is_newer(heads);
        Ok(())
    }

    /// Address of one of the pages before the settings.
    fn beyond(number: u8) -> u16 {
        let back = usize::from(Self::BEYOND.saturating_sub(number)).saturating_mul(M::PAGE);
        address::<M>(0, false).saturating_sub(back as u16)
    }

    /// The epoch that counts, found from the copies that were loaded. The first page decides, because every factory
    /// reset writes it; another page may be so many epochs old that its wrapped number looks newer. If the first page
    /// is `lost`, because both copies hold something else, the others do not count. Another layout has taken the place,
    /// or what is left would be old settings among defaults.
    fn find_epoch(&mut self, lost: bool) -> u16 {
        let epochs = |pairs: &[Pair]| {
            let epochs = pairs.iter().flat_map(|pair| pair.found).flatten().map(|(epoch, _)| epoch);
            epochs.reduce(|a, b| if page::newer(b, a) { b } else { a })
        };
        let [first, rest @ ..] = self.pairs.as_mut() else { return 0 };
        if let Some(epoch) = epochs(core::slice::from_ref(first)) {
            return epoch;
        }
        let epoch = epochs(rest).unwrap_or_default();
        if lost {
            return epoch.wrapping_add(1);
        }
        // Without a readable first page the epoch is certain only if all other pages agree on one.
        first.unformatted |= rest.iter().flat_map(|pair| pair.found).flatten().any(|(found, _)| found != epoch);
        epoch
    }

    /// Settings that are all zero: [`forget`](Self::forget) must fill in the factory defaults before use.
    pub(super) const fn new() -> Self {
        Settings {
            durable: M::Values::ZEROS,
            wanted: M::Values::ZEROS,
            pairs: M::Pairs::ZEROS,
            epoch: 0,
            dirty: 0,
            forced: 0,
            strange: 0,
            second_first: false,
            clearing: false,
            epochs: Epochs::after(0, false),
            in_flight: None,
            unreachable: false,
        }
    }

    /// Factory defaults everywhere, as with a fresh EEPROM.
    pub(super) fn forget(&mut self) {
        *self = Self::new();
        self.default();
    }

    /// Makes the factory defaults both the wanted and the durable values.
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

    /// Sets the wanted value of a slot. A value that is durable already is not written again. False if there is no such
    /// slot.
    pub(super) fn set(&mut self, slot: usize, value: i32) -> bool {
        if slot >= M::LAYOUT.defaults.len() {
            return false;
        }
        let Some(wanted) = self.wanted.as_mut().get_mut(slot) else { return false };
        *wanted = value;
        self.mark(Self::page_of_slot(slot));
        if !Self::TWICE && !self.settled() {
            self.format();
        }
        true
    }

    /// Sets all wanted values to factory defaults by beginning a new epoch.
    pub(super) fn reset(&mut self) {
        if Self::TWICE {
            set_defaults::<M>(self.wanted.as_mut(), 0);
            return self.renew();
        }
        self.epoch = self.epoch.wrapping_add(1);
        self.default();
        if let Some(first) = self.pairs.as_mut().first_mut() {
            first.forced = BOTH;
            self.forced |= bit(0);
        }
        self.format();
    }

    /// Orders both copies of each unformatted page to be written, after what another layout has left before the
    /// settings is cleared. Where that layout may have its first page, and where this one has it, no copy may stay
    /// another's. Else settings would count with it of which the others are gone.
    fn format(&mut self) {
        self.clearing = self.strange > 0;
        let strangers = self.clearing || self.pairs.as_ref().iter().any(|pair| pair.unformatted);
        for (index, pair) in self.pairs.as_mut().iter_mut().enumerate() {
            let is_first = index == 0 || index == Self::FIRST_OF_OTHER;
            let is_ours = pair.found.iter().all(Option::is_some);
            if (pair.unformatted || strangers && is_first && !is_ours) && pair.forced == 0 {
                pair.forced = BOTH;
                self.forced |= bit(index);
            }
        }
    }

    /// True when all wanted values are durable. A page being written may fail, so it counts as not durable until its
    /// write has ended.
    pub(super) fn settled(&self) -> bool {
        let waits = |settings: &Self| settings.in_flight.is_some() && !(Self::TWICE && settings.epochs.is_idle());
        self.dirty == 0 && self.forced == 0 && !self.clearing && !self.is_storing() && !waits(self)
    }

    /// True while a store of all pages together is not in force.
    pub(super) const fn is_storing(&self) -> bool {
        Self::TWICE && self.epochs.is_storing()
    }

    /// Begins a store of all pages together, also if no value has changed.
    pub(super) fn renew(&mut self) {
        let Some(number) = Self::TOGETHER.and_then(|slot| self.wanted.as_mut().get_mut(slot)) else { return };
        *number = Self::USED as i32;
        self.epochs.begin(bit(Self::USED).wrapping_sub(1));
    }

    /// The next page of a store of all pages together.
    fn next_together(&mut self) -> Option<Job> {
        if !self.is_storing() && self.dirty != 0 {
            self.renew();
        }
        let (step, page) = self.epochs.next(self.unreachable);
        let (epoch, values, repeats) = match step {
            Step::Found => (self.epoch, &self.durable, false),
            Step::First => (self.epochs.epoch, &self.wanted, false),
            Step::Second => (self.epoch, &self.durable, true),
            Step::Ask => {
                self.in_flight = Some(Flight { page, epoch: self.epoch, image: page::Page::new() });
                return Some(Job { address: 0, page: page::Page::new() });
            }
            Step::None => return None,
        };
        let Pair { newest: (side, sequence), .. } = *self.pairs.as_ref().get(page)?;
        let sequence = if repeats { sequence } else { sequence.wrapping_add(1) };
        let image = page::encode(M::LAYOUT.tag, page, epoch, sequence, page_of::<M>(values, page)?);
        self.in_flight = Some(Flight { page, epoch, image: image.clone() });
        Some(Job { address: address::<M>(page, !side), page: image })
    }

    /// A step of a store of all pages together has ended.
    fn finish_together(&mut self, page: usize, written: bool) -> Ended {
        match self.epochs.finish(page, written) {
            Step::Second => return Ended::Spare,
            Step::Ask => return Ended::Question,
            _ if !written => self.revert(),
            Step::Found => self.turn(1),
            // The first page is the last one: with it the epoch is in force.
            Step::First if page == 0 => {
                self.turn(Self::USED);
                self.epoch = self.epochs.epoch;
                copy(self.durable.as_mut(), self.wanted.as_ref());
                (self.dirty, self.epochs.lost) = (0, 0);
                self.epochs.repeat(bit(Self::USED).wrapping_sub(1));
            }
            Step::First | Step::None => {}
        }
        Ended::Values
    }

    /// Of the first pages the copy that was not in force is the one that is.
    fn turn(&mut self, pages: usize) {
        for pair in self.pairs.as_mut().iter_mut().take(pages) {
            pair.newest = (!pair.newest.0, pair.newest.1.wrapping_add(1));
        }
    }

    /// All wanted values go back to the durable ones.
    fn revert(&mut self) {
        copy(self.wanted.as_mut(), self.durable.as_ref());
        self.dirty = 0;
    }

    /// The next page to write; `None` until [`finish`](Self::finish) reports on the page handed out before.
    pub(super) fn next_job(&mut self) -> Option<Job> {
        if self.in_flight.is_some() {
            return None;
        }
        if Self::TWICE {
            return self.next_together();
        }
        if Self::BEYOND > 0 && self.clearing {
            return Some(self.clear());
        }
        let candidates = if self.forced == 0 { self.dirty } else { self.forced };
        if candidates == 0 {
            return None;
        }
        let index = usize::try_from(candidates.trailing_zeros()).ok()?;
        let Pair { unformatted, newest: (side, sequence), .. } = *self.pairs.as_ref().get(index)?;
        // An unformatted page is written with the values it counted as before: if the write fails, no wanted value has
        // been stored.
        let values = page_of::<M>(if unformatted { &self.durable } else { &self.wanted }, index)?;
        let image = page::encode(M::LAYOUT.tag, index, self.epoch, sequence.wrapping_add(1), values);
        self.in_flight = Some(Flight { page: index, epoch: self.epoch, image: image.clone() });
        Some(Job { address: address::<M>(index, !side), page: image })
    }

    /// The next of the pages before the settings to be cleared.
    fn clear(&mut self) -> Job {
        let number = match Self::BEYOND.saturating_sub(self.strange) {
            number @ 0..2 if self.second_first => 1_u8.saturating_sub(number),
            number => number,
        };
        let mut page = page::Page::new();
        // A page is no longer than this.
        let _ = page.resize(M::PAGE, CLEARED);
        self.in_flight = Some(Flight { page: 0, epoch: self.epoch, image: page.clone() });
        Job { address: Self::beyond(number), page }
    }

    /// Reports that the page handed out last is durable (`written`). If it could not be written, and had values that
    /// are to be stored, all wanted values go back to the durable ones.
    pub(super) fn finish(&mut self, written: bool) -> Ended {
        let Some(Flight { page, epoch, image }) = self.in_flight.take() else { return Ended::Values };
        if Self::TWICE {
            return self.finish_together(page, written);
        }
        if !written {
            self.revert();
            let pairs = self.pairs.as_mut();
            // A factory reset that has not come to its end is the first that the next store writes: the values here are
            // its.
            if let Some(first) = pairs.first_mut() {
                first.unformatted |= first.forced > 0;
            }
            pairs.iter_mut().for_each(|pair| pair.forced = 0);
            (self.forced, self.clearing) = (0, false);
            return Ended::Values;
        }
        if Self::BEYOND > 0 && self.clearing {
            self.strange = self.strange.saturating_sub(1);
            self.clearing = self.strange > 0;
            return Ended::Values;
        }
        let Some(pair) = self.pairs.as_mut().get_mut(page) else { return Ended::Values };
        pair.newest = (!pair.newest.0, pair.newest.1.wrapping_add(1));
        if epoch != self.epoch {
            // A factory reset has begun a new epoch meanwhile, so the page that was written no longer counts.
            return Ended::Values;
        }
        if let Some(durable) = self.durable.as_mut().get_mut(Self::slots(page)) {
            page::take_values(&image, durable);
        }
        pair.forced = pair.forced.saturating_sub(1);
        if pair.forced == 0 {
            pair.unformatted = false;
            pair.found = [Some((epoch, pair.newest.1)); 2];
            self.forced &= !bit(page);
        }
        self.mark(page);
        Ended::Values
    }

    /// Finds out whether a page is dirty.
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

/// Copies values between arrays of the same length.
fn copy(to: &mut [i32], from: &[i32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}

/// Fills `values` with the factory defaults of the slots from `first` on, and with 0 behind the last slot.
fn set_defaults<M: Memory>(values: &mut [i32], first: usize) {
    values.fill(0);
    let defaults = M::LAYOUT.defaults.get(first..).unwrap_or_default();
    values.iter_mut().zip(defaults).for_each(|(value, default)| *value = *default);
}
