//! The contents of the EEPROM: a program in its first pages, settings in its last pages. A product's [`Memory`] gives
//! the sizes. The meaning of the settings and of the program's bytes is known to the firmware above this module alone.
//!
//! A setting is a 32-bit value with a number, its slot; a page of 64 bytes has room for 14 slots. Each settings page
//! exists in two copies, which are written in turn, each with a sequence number and a CRC: when a write is cut short,
//! the older copy remains. A factory reset takes effect with its first page write: that write begins a new epoch, and
//! pages of older epochs no longer count. A layout may have all its pages stored together instead, each of them twice
//! ([`Storing`]): `epochs.rs` tells how.
//!
//! An EEPROM may come from a sister or from the module's other firmware, whose settings have another [`Layout`]. The
//! first store takes it over, beginning with the first page of either layout. Where both copies of a layout's first
//! page are gone, none of its pages counts any more, so that a layout has all of its settings or its defaults. What the
//! other layout has before the pages of this one is cleared first; programs stay.
//!
//! The program exists in one copy. Two slots record whether the program is whole, and its check sum. These slots change
//! before the first page of a download and after the last one, so that a download cut short is recognised.
//!
//! [`Store`] compares what is wanted with what is durable in the EEPROM and hands out page writes one at a time,
//! without touching the chip. The [`Keeper`] carries the page writes out while the firmware goes on.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod copies;
mod epochs;
mod keeper;
mod memory;
mod page;
mod program;
mod settings;

pub use keeper::Keeper;
pub use memory::{Array, FIRST_SLOT, LONGEST_PAGE, Layout, Memory, Pair, Storing};
pub use page::{Job, Page};

use program::Program;
use settings::{Ended, Settings};

/// The state in which the EEPROM was found at start-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadReport {
    /// Page copies that hold settings of this layout.
    pub valid: u8,
    /// Page copies that hold other bytes: another firmware's data, or a write cut short.
    pub foreign: u8,
    /// The EEPROM does not answer.
    pub unreachable: bool,
    /// Pages, one bit each, that belong to the settings in force and are gone, so that their values are unknown
    /// ([`Storing::Epochs`]). Bit 0 is set if the first page is gone, which says how many there are: then all are
    /// unknown.
    pub lost: u64,
    /// True if one of the two copies of a page is bad ([`Storing::Epochs`]): it is written again.
    pub worn: bool,
    /// The state of the stored program.
    pub program: Integrity,
}

/// Whether program memory holds a program that may run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrity {
    /// No program is stored.
    #[default]
    Empty,
    /// A program is stored, downloaded to its end and with the recorded check sum.
    Whole,
    /// A download has not come to its end, or the check sum is wrong: the program must not run.
    Incomplete,
    /// The program is to be erased; then the slot [`Layout::after_erasing`] gets this value, 0..=3.
    BeingErased(i32),
}

impl Integrity {
    /// Bit of the stored integrity that stands for [`Integrity::BeingErased`], and the bits of its value.
    const ERASURE: i32 = 4;
    const VALUE: i32 = 3;

    fn from_slot(value: i32) -> Self {
        match value {
            0 => Integrity::Empty,
            1 => Integrity::Whole,
            4..=7 => Integrity::BeingErased(value & Self::VALUE),
            _ => Integrity::Incomplete,
        }
    }

    fn to_slot(self) -> i32 {
        match self {
            Integrity::Empty => 0,
            Integrity::Whole => 1,
            Integrity::Incomplete => 2,
            Integrity::BeingErased(value) => Integrity::ERASURE | value & Self::VALUE,
        }
    }
}

/// The work of the store on program memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Activity {
    Idle,
    /// A download runs: the next bytes go to the byte offset `next`, and pages that end before `next` are written
    /// meanwhile. After a failed page write no more pages are written until the download ends.
    Downloading {
        next: usize,
        failed: bool,
    },
    /// The download has ended, and its last pages are being written.
    Flushing,
    /// All pages are durable, and the page that marks the program as whole is being written.
    MarkingWhole,
    /// The page that marks the program as being erased is being written; only then program memory is emptied.
    MarkingErasure,
    /// The emptied pages are being written.
    Erasing,
}

/// The data that must be durable before the reply to a storing command may be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The settings.
    Settings,
    /// The settings and the program.
    Program,
}

/// The outcome of a page write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Finished {
    /// The data that could not be written; every command that waits for it has failed.
    pub failed: Option<Need>,
    /// The EEPROM, which did not answer at start-up, does now ([`Storing::Epochs`]).
    pub answers: bool,
    /// The settings are durable, but the second copy of a page could not be written ([`Storing::Epochs`]).
    pub worn: bool,
    /// The program has been erased, and the slot [`Layout::after_erasing`] has got this value.
    pub erased: Option<i32>,
}

/// Slots of the store itself: the program's integrity and its check sum.
const INTEGRITY: usize = 0;
const SUM: usize = 1;

/// The settings and the program, as they are in the EEPROM and as they are wanted.
#[derive(Debug)]
pub struct Store<M: Memory> {
    settings: Settings<M>,
    program: Program<M>,
    activity: Activity,
}

impl<M: Memory> Default for Store<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Memory> Store<M> {
    /// A store to be filled by [`Store::forget`] or [`Store::load`] before use. All its bytes are zero, so that a
    /// static store takes no flash for initial values.
    pub const fn new() -> Self {
        const { assert!(memory::fits::<M>(), "settings or program have no place in the EEPROM") };
        Store { settings: Settings::new(), program: Program::new(), activity: Activity::Idle }
    }

    /// Factory defaults and no program, as with a fresh EEPROM.
    pub fn forget(&mut self) {
        self.settings.forget();
        self.program.forget();
        self.activity = Activity::Idle;
    }

    /// Reads the EEPROM through `read(address, page)`. Settings pages that are foreign or damaged stay as they are in
    /// the EEPROM and count as factory defaults. A program that is not whole reads as empty.
    ///
    /// # Errors
    /// The first error of `read`.
    pub fn load<E>(&mut self, mut read: impl FnMut(u16, &mut [u8]) -> Result<(), E>) -> Result<LoadReport, E> {
        let mut report = self.settings.load(&mut read)?;
        self.program.load(&mut read)?;
        self.activity = Activity::Idle;
        report.program = self.integrity();
        match report.program {
            Integrity::Whole => {}
            Integrity::Empty | Integrity::Incomplete => self.program.erase(),
            Integrity::BeingErased(_) => {
                self.activity = Activity::MarkingErasure;
                self.advance();
            }
        }
        Ok(report)
    }

    /// In place of [`Store::load`] with an EEPROM that does not answer: factory defaults, none of which counts as
    /// durable.
    pub fn unreachable(&mut self) -> LoadReport {
        self.forget();
        self.settings.unreachable = true;
        LoadReport { unreachable: true, ..LoadReport::default() }
    }

    /// True when the EEPROM did not answer at start-up, so that its contents are unknown.
    pub const fn is_unreachable(&self) -> bool {
        self.settings.unreachable
    }

    /// Pages whose values are unknown, one bit each, as [`LoadReport::lost`] has them; none after a store.
    pub const fn lost(&self) -> u64 {
        self.settings.epochs.lost
    }

    /// True if the copy of a page was bad at start-up.
    pub const fn is_worn(&self) -> bool {
        self.settings.epochs.worn
    }

    /// The page of a slot.
    pub fn page_of(slot: usize) -> usize {
        Settings::<M>::page_of_slot(slot)
    }

    /// The stored value of a slot; `None` if there is no such slot.
    pub fn get(&self, slot: usize) -> Option<i32> {
        self.settings.get(slot)
    }

    /// Sets the wanted value of a slot. A value that is durable already is not written again. False if there is no such
    /// slot.
    #[must_use]
    pub fn set(&mut self, slot: usize, value: i32) -> bool {
        self.settings.set(slot, value)
    }

    /// Has all pages stored anew, together with what has been set, also if nothing has ([`Storing::Epochs`]).
    pub fn renew(&mut self) {
        self.settings.renew();
    }

    /// Sets all wanted values to factory defaults. With `erase` the program is erased, too; otherwise it stays.
    pub fn reset(&mut self, erase: bool) {
        let integrity = if erase { Integrity::BeingErased(0) } else { self.integrity() };
        let sum = self.get(SUM).unwrap_or_default();
        self.settings.reset();
        // Integrity and check sum are in the first page, whose write begins the new epoch.
        self.record(integrity);
        self.settings.set(SUM, sum);
        if let Integrity::BeingErased(_) = integrity {
            self.activity = Activity::MarkingErasure;
        }
    }

    /// Whether program memory holds a program that may run.
    pub fn integrity(&self) -> Integrity {
        match self.recorded() {
            // The slot is not durable yet, or a page has changed since the program was whole.
            Integrity::Whole if self.activity == Activity::MarkingWhole || !self.sum_is_right() => {
                Integrity::Incomplete
            }
            integrity => integrity,
        }
    }

    fn sum_is_right(&self) -> bool {
        self.program.sum().map(u32::cast_signed) == self.get(SUM)
    }

    /// The program's integrity as its slot has it.
    fn recorded(&self) -> Integrity {
        Integrity::from_slot(self.get(INTEGRITY).unwrap_or_default())
    }

    fn record(&mut self, integrity: Integrity) {
        self.settings.set(INTEGRITY, integrity.to_slot());
    }

    /// The bytes of program memory.
    pub fn program(&self) -> &[u8] {
        self.program.bytes()
    }

    /// The byte offset to which the next bytes of a download go; `None` while no download runs.
    pub fn downloading(&self) -> Option<usize> {
        match self.activity {
            Activity::Downloading { next, .. } => Some(next),
            _ => None,
        }
    }

    /// True when a download may begin: the previous download is durable, and the program is not being erased.
    pub fn takes_download(&self) -> bool {
        let free = matches!(self.activity, Activity::Idle | Activity::Downloading { .. });
        free && !matches!(self.integrity(), Integrity::BeingErased(_))
    }

    /// Begins a download at a byte offset; until [`Store::end_download`] and its page writes the program is incomplete.
    pub fn begin_download(&mut self, offset: usize) {
        self.record(Integrity::Incomplete);
        self.activity = Activity::Downloading { next: offset, failed: false };
    }

    /// Takes the next bytes of a download. False when no download runs, or the bytes would lie outside program memory.
    pub fn download(&mut self, bytes: &[u8]) -> bool {
        let Activity::Downloading { next, .. } = &mut self.activity else { return false };
        let end = next.saturating_add(bytes.len());
        if end > M::Program::LENGTH {
            return false;
        }
        self.program.write(core::mem::replace(next, end), bytes);
        true
    }

    /// Ends a download: once all its pages are written, the program is marked as whole.
    pub fn end_download(&mut self) {
        if self.downloading().is_some() {
            self.activity = Activity::Flushing;
            self.advance();
        }
    }

    /// Erases the program, and then sets the slot [`Layout::after_erasing`] to a value, 0..=3. The intent is made
    /// durable before the first page is erased, so that a power cut at any point never shows a read-protected program.
    /// Returns the value if the slot has got it at once, because nothing was left to erase.
    #[must_use]
    pub fn erase(&mut self, value: i32) -> Option<i32> {
        self.record(Integrity::BeingErased(value));
        self.activity = Activity::MarkingErasure;
        self.advance()
    }

    /// True when all wanted values, and the program where `need` asks for it, are durable.
    pub fn settled(&self, need: Need) -> bool {
        let busy = !matches!(self.activity, Activity::Idle | Activity::Downloading { .. });
        self.settings.settled() && !(busy && need == Need::Program)
    }

    /// True while a store is under way that comes into force with its last page ([`Storing::Epochs`]). No value may be
    /// set before it has ended.
    pub fn is_storing(&self) -> bool {
        self.settings.is_storing()
    }

    /// True while nothing is to be written and no download is open.
    pub fn is_idle(&self) -> bool {
        matches!(self.activity, Activity::Idle) && self.settings.settled() && !self.program.in_flight()
    }

    /// The next page to write; `None` until [`Store::finish`] reports on the page handed out before.
    pub fn next_job(&mut self) -> Option<Job> {
        if self.program.in_flight() {
            return None;
        }
        // Settings pages are written first, because the program's integrity is in one of them.
        if !self.settings.settled() {
            return self.settings.next_job();
        }
        let end = match self.activity {
            Activity::Downloading { next, failed: false } => next,
            Activity::Flushing | Activity::Erasing => usize::MAX,
            // Second copies of what is durable are no hurry.
            Activity::Idle if Settings::<M>::TWICE => return self.settings.next_job(),
            Activity::Idle | Activity::MarkingWhole | Activity::MarkingErasure | Activity::Downloading { .. } => {
                return None;
            }
        };
        self.program.next_job(end)
    }

    /// Reports that the page handed out last is durable (`written`), or could not be written. After a failed write of a
    /// settings page all wanted values go back to the durable ones. So a host never reads a value as stored that is
    /// lost at power-off.
    pub fn finish(&mut self, written: bool) -> Finished {
        let failed = if self.program.finish(written) {
            (!written).then_some(Need::Program)
        } else {
            match self.settings.finish(written) {
                Ended::Values => (!written).then_some(Need::Settings),
                Ended::Spare => return Finished { worn: !written, ..Finished::default() },
                Ended::Question => return Finished { answers: written, ..Finished::default() },
            }
        };
        let mut erased = None;
        match (failed, self.activity) {
            (None, _) => erased = self.advance(),
            // The page is written again at the end of the download.
            (Some(Need::Program), Activity::Downloading { next, .. }) => {
                self.activity = Activity::Downloading { next, failed: true };
            }
            (Some(Need::Settings), Activity::Downloading { .. }) if self.recorded() == Integrity::Incomplete => {}
            (Some(_), _) => self.activity = Activity::Idle,
        }
        Finished { failed, erased, ..Finished::default() }
    }

    /// Begins the next activity if the present one has finished. When the program is erased by that, returns the value
    /// that the slot [`Layout::after_erasing`] has got.
    fn advance(&mut self) -> Option<i32> {
        if self.activity == Activity::MarkingErasure && self.settings.settled() {
            self.program.erase();
            self.activity = Activity::Erasing;
        }
        let sum = self.program.sum()?;
        match (self.activity, self.recorded()) {
            (Activity::Flushing, _) => {
                self.activity = Activity::MarkingWhole;
                self.settings.set(SUM, sum.cast_signed());
                self.record(Integrity::Whole);
            }
            (Activity::MarkingWhole, _) if self.settings.settled() => {
                self.activity = Activity::Idle;
            }
            (Activity::Erasing, Integrity::BeingErased(value)) => {
                self.settings.set(M::LAYOUT.after_erasing, value);
                self.record(Integrity::Empty);
                self.activity = Activity::Idle;
                return Some(value);
            }
            _ => {}
        }
        None
    }
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects)]
mod tests;
