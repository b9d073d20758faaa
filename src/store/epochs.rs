//! Storing all pages together, as [`Storing::Epochs`](super::Storing::Epochs) has it: a power cut at any moment leaves all the
//! old values or all the new ones, and one bad copy loses nothing.
//!
//! | what is written | epoch | then |
//! |---|---|---|
//! | the first page, if this layout has none yet: its values as they count now | that in force | an epoch of later pages does not count by itself |
//! | a copy of each page in use, over the one that is not in force; the first page last | a new one | the new epoch is in force, and the store is confirmed |
//! | the second copies, the first page first | the same | each page is there twice |
//!
//! At the start the newest epoch of the first page counts. It says how many pages belong to it, and each of them is there,
//! once or twice. What is there once is written a second time.

/// What is to be written next. Of two copies it is always the one that is not in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// The first page as it counts now.
    Found,
    /// A page with what is to be stored.
    First(usize),
    /// The second copy of a page that is in force.
    Second(usize),
}

/// How far a store has come.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Progress {
    /// The epoch of the store under way, or of the last one.
    pub(super) epoch: u16,
    /// The first page is there, in one copy at least.
    pub(super) founded: bool,
    /// Pages, one bit each, of which the first copy is to be written.
    first: u64,
    /// Pages, one bit each, of which the second copy is to be written.
    second: u64,
}

impl Progress {
    /// Nothing to write, after this epoch.
    pub(super) const fn after(epoch: u16, founded: bool) -> Self {
        Progress { epoch, founded, first: 0, second: 0 }
    }

    /// Begins a store of these pages, the first one among them. Its epoch is that of no store before, also of none that has
    /// failed: what is left of that must not count.
    pub(super) const fn begin(&mut self, pages: u64) {
        (self.epoch, self.first, self.second) = (self.epoch.wrapping_add(1), pages, 0);
    }

    /// True while a store is under way: it is not in force.
    pub(super) const fn is_storing(&self) -> bool {
        self.first != 0
    }

    /// These pages are to be written a second time.
    pub(super) const fn repeat(&mut self, pages: u64) {
        self.second = pages;
    }

    /// What is to be written next.
    pub(super) fn step(&self) -> Option<Step> {
        let lowest = |pages: u64| (pages != 0).then(|| pages.trailing_zeros() as usize);
        match lowest(self.first & !1) {
            _ if self.is_storing() && !self.founded => Some(Step::Found),
            Some(page) => Some(Step::First(page)),
            None if self.is_storing() => Some(Step::First(0)),
            None => lowest(self.second).map(Step::Second),
        }
    }

    /// A step is done, or could not be: then all of its kind are given up.
    pub(super) const fn finish(&mut self, step: Step, written: bool) {
        match step {
            Step::Found if written => self.founded = true,
            Step::First(page) if written => self.first &= !super::settings::bit(page),
            Step::Second(page) if written => self.second &= !super::settings::bit(page),
            Step::Found | Step::First(_) => self.first = 0,
            Step::Second(_) => self.second = 0,
        }
    }
}
