//! Storing all pages together, as [`Storing::Epochs`](super::Storing::Epochs) has it: a power cut at any moment leaves
//! all the old values or all the new ones, and one bad copy loses nothing.
//!
//! | what is written | epoch | then |
//! |---|---|---|
//! | the first page, if this layout has none yet: its values as they count now | that in force | an epoch of later pages does not count by itself |
//! | a copy of each page in use, over the one that is not in force; the first page last | a new one | the new epoch is in force, and the store is confirmed |
//! | the second copies, the first page first | the same | each page is there twice |
//!
//! At the start the newest epoch of the first page counts. It says how many pages belong to it, and each of them is
//! there, once or twice. What is there once is written a second time.

use super::copies::bit;

/// The step that is done next. Of two copies it is always the one that is written that is not in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Step {
    /// Nothing. As the first of all it is zero in memory, and so is a store that has done nothing.
    None,
    /// The first page is written as it counts now.
    Found,
    /// A page is written with what is to be stored.
    First,
    /// The second copy of a page is written, which is in force.
    Second,
    /// An EEPROM that did not answer at start-up is asked whether it does now.
    Ask,
}

/// So many times the next step has been asked for, about once a millisecond, before an EEPROM that does not answer is
/// asked again.
const AGAIN: u16 = 1_000;

/// How far a store has come, and what was found at the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Epochs {
    /// The epoch of the store under way, or of the last one.
    pub(super) epoch: u16,
    /// The first page is there, in one copy at least.
    founded: bool,
    /// Pages, one bit each, of which the first copy is to be written.
    first: u64,
    /// Pages, one bit each, of which the second copy is to be written.
    second: u64,
    /// The step that is being done.
    under_way: Step,
    /// How often the next step has been asked for since an EEPROM that does not answer was asked.
    asked: u16,
    /// See [`LoadReport`](super::LoadReport).
    pub(super) lost: u64,
    pub(super) worn: bool,
}

impl Epochs {
    /// Nothing to write, after this epoch.
    pub(super) const fn after(epoch: u16, founded: bool) -> Self {
        Epochs { epoch, founded, first: 0, second: 0, under_way: Step::None, asked: 0, lost: 0, worn: false }
    }

    /// Begins a store of these pages, the first one among them. Its epoch is that of no store before, also of none that
    /// has failed: what is left of that must not count.
    pub(super) const fn begin(&mut self, pages: u64) {
        (self.epoch, self.first, self.second) = (self.epoch.wrapping_add(1), pages, 0);
    }

    /// True while a store is under way: it is not in force.
    pub(super) const fn is_storing(&self) -> bool {
        self.first != 0
    }

    /// True if what is being done keeps nobody waiting.
    pub(super) const fn is_idle(&self) -> bool {
        matches!(self.under_way, Step::None | Step::Second | Step::Ask)
    }

    /// Has these pages written a second time.
    pub(super) const fn repeat(&mut self, pages: u64) {
        self.second = pages;
    }

    /// Begins the next step, with this page; `silent` is an EEPROM that did not answer at start-up.
    pub(super) fn next(&mut self, silent: bool) -> (Step, usize) {
        let lowest = |pages: u64| pages.trailing_zeros() as usize;
        let (step, page) = match self.first & !1 {
            _ if self.is_storing() && !self.founded => (Step::Found, 0),
            0 if self.is_storing() => (Step::First, 0),
            0 if silent => (self.ask(), 0),
            0 if self.second != 0 => (Step::Second, lowest(self.second)),
            0 => (Step::None, 0),
            others => (Step::First, lowest(others)),
        };
        self.under_way = step;
        (step, page)
    }

    const fn ask(&mut self) -> Step {
        self.asked = self.asked.wrapping_add(1);
        if self.asked < AGAIN {
            return Step::None;
        }
        self.asked = 0;
        Step::Ask
    }

    /// The step under way is done with this page, or could not be: then all of its kind are given up. Returns which it
    /// was.
    pub(super) const fn finish(&mut self, page: usize, done: bool) -> Step {
        let (step, others) = (self.under_way, !bit(page));
        self.under_way = Step::None;
        match step {
            Step::Found if done => self.founded = true,
            Step::First if done => self.first &= others,
            Step::Second if done => self.second &= others,
            Step::Found | Step::First => self.first = 0,
            Step::Second => self.second = 0,
            Step::Ask | Step::None => {}
        }
        step
    }
}
