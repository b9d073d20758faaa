//! What survives power-off: a program in the first pages of the EEPROM, settings in the last ones. A [`Memory`] says how large
//! all of it is.
//!
//! A setting has a slot, which is a number; 14 slots make a page of 64 bytes. Each page exists twice and the two copies are
//! written in turn, with a sequence number and a CRC: a write cut short leaves the older copy. A factory
//! reset is one page write, too: it begins a new epoch, and pages of an older one count no more. What a setting means, and what
//! the bytes of the program, is not known here.
//!
//! The program exists once. Two slots say what it is worth: whether it is whole, and its check sum. They change
//! before the first of its pages and after the last one, so that a download cut short is known as such.
//!
//! Nothing in here touches the part. [`Store`] knows what is durable and what is wanted, and hands out page
//! writes one at a time; the [`Keeper`] carries them out beside everything else.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod keeper;
mod memory;
mod page;
mod program;
mod settings;

pub use keeper::Keeper;
pub use memory::{Array, FIRST_SLOT, LONGEST_PAGE, Layout, Memory, Pair};
pub use page::{Job, Page};

use program::Program;
use settings::Settings;

/// What was found in the EEPROM at start-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Page copies that hold settings of ours.
    pub valid: u8,
    /// Page copies that hold something else: another firmware's data, or a write cut short.
    pub foreign: u8,
    /// The part does not answer.
    pub unreachable: bool,
    /// The program.
    pub program: Worth,
}

/// What program memory is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Worth {
    /// There is no program.
    #[default]
    Empty,
    /// There is one.
    Whole,
    /// A download has not come to its end: it must not run.
    Incomplete,
    /// The program is to be erased, and then [`Layout::after_erasing`] gets this value.
    Erasing(i32),
}

impl Worth {
    /// Added to the value for the slot, 0..=3.
    const ERASING: i32 = 4;
    const AFTER: i32 = 3;

    fn from_slot(value: i32) -> Self {
        match value {
            0 => Worth::Empty,
            1 => Worth::Whole,
            4..=7 => Worth::Erasing(value & Self::AFTER),
            _ => Worth::Incomplete,
        }
    }

    fn to_slot(self) -> i32 {
        match self {
            Worth::Empty => 0,
            Worth::Whole => 1,
            Worth::Incomplete => 2,
            Worth::Erasing(value) => Worth::ERASING | value & Self::AFTER,
        }
    }
}

/// What goes on with program memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    /// Bytes come in, the next ones to this offset; pages before it are written behind.
    Downloading {
        next: usize,
        failed: bool,
    },
    /// All pages are written, then the program counts as whole.
    Closing,
    /// As soon as it is recorded that the program is whole, it is.
    Sealing,
    /// As soon as the intent is durable the memory is emptied.
    Intending,
    /// All pages are written, then the program counts as gone and a slot gets its value.
    Erasing,
}

/// What a command waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The settings.
    Settings,
    /// The settings and the program.
    Program,
}

/// What came of a page write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Finished {
    /// What has failed, and with it all that needs it.
    pub failed: Option<Need>,
    /// The program has been erased, and [`Layout::after_erasing`] has got this value.
    pub erased: Option<i32>,
}

/// Slots of the store itself: what the program is worth, and its check sum.
const WORTH: usize = 0;
const SUM: usize = 1;

/// The settings and the program, as they are in the EEPROM and as they shall be.
#[derive(Debug)]
pub struct Store<M: Memory> {
    settings: Settings<M>,
    program: Program<M>,
    phase: Phase,
}

impl<M: Memory> Default for Store<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: Memory> Store<M> {
    /// A store that has not been filled: see [`Store::forget`] and [`Store::load`]. All zeros, so that it may be a
    /// static without a copy in the flash.
    pub const fn new() -> Self {
        const { assert!(memory::fits::<M>(), "settings or program have no place in the EEPROM") };
        Store { settings: Settings::new(), program: Program::new(), phase: Phase::Idle }
    }

    /// Factory defaults and no program, as with a fresh EEPROM.
    pub fn forget(&mut self) {
        self.settings.forget();
        self.program.forget();
        self.phase = Phase::Idle;
    }

    /// Reads everything through `read(address, page)`. Pages of settings that are not ours, or damaged, are
    /// left alone and count as factory defaults. A program that is not whole is none.
    pub fn load<E>(&mut self, mut read: impl FnMut(u16, &mut [u8]) -> Result<(), E>) -> Result<Report, E> {
        let mut report = self.settings.load(&mut read)?;
        self.program.load(&mut read)?;
        self.phase = Phase::Idle;
        report.program = self.worth();
        match report.program {
            Worth::Whole => {}
            Worth::Empty | Worth::Incomplete => self.program.erase(),
            Worth::Erasing(_) => {
                self.phase = Phase::Intending;
                self.advance();
            }
        }
        Ok(report)
    }

    /// The same for a part that does not answer: nothing counts as durable, whatever its value.
    pub fn unreachable(&mut self) -> Report {
        self.forget();
        self.settings.unreachable = true;
        Report { unreachable: true, ..Report::default() }
    }

    /// True when nobody knows what is stored, because the part does not answer.
    pub const fn is_unreachable(&self) -> bool {
        self.settings.unreachable
    }

    /// The stored value of a slot; `None` if there is no such slot.
    pub fn get(&self, slot: usize) -> Option<i32> {
        self.settings.get(slot)
    }

    /// Wants a value in a slot. What is there already is not written again. False if there is no such slot.
    #[must_use]
    pub fn set(&mut self, slot: usize, value: i32) -> bool {
        self.settings.set(slot, value)
    }

    /// Wants factory defaults everywhere. The program stays, or is erased, too.
    pub fn reset(&mut self, erase: bool) {
        let worth = if erase { Worth::Erasing(0) } else { self.worth() };
        let sum = self.get(SUM).unwrap_or_default();
        self.settings.reset();
        // Both are in the page that begins the new epoch.
        self.record(worth);
        self.settings.set(SUM, sum);
        if let Worth::Erasing(_) = worth {
            self.phase = Phase::Intending;
        }
    }

    /// What program memory is worth.
    pub fn worth(&self) -> Worth {
        match self.recorded() {
            // Not yet, or not any more.
            Worth::Whole if self.phase == Phase::Sealing || !self.sum_is_right() => Worth::Incomplete,
            worth => worth,
        }
    }

    fn sum_is_right(&self) -> bool {
        self.program.sum().map(u32::cast_signed) == self.get(SUM)
    }

    /// What the slot says of it.
    fn recorded(&self) -> Worth {
        Worth::from_slot(self.get(WORTH).unwrap_or_default())
    }

    fn record(&mut self, worth: Worth) {
        self.settings.set(WORTH, worth.to_slot());
    }

    /// Program memory.
    pub fn program(&self) -> &[u8] {
        self.program.bytes()
    }

    /// The offset to which the next bytes of a download go, while there is one.
    pub fn downloading(&self) -> Option<usize> {
        match self.phase {
            Phase::Downloading { next, .. } => Some(next),
            _ => None,
        }
    }

    /// True when a download may begin: the one before is written, and nothing is being erased.
    pub fn takes_download(&self) -> bool {
        let free = matches!(self.phase, Phase::Idle | Phase::Downloading { .. });
        free && !matches!(self.worth(), Worth::Erasing(_))
    }

    /// Begins a download at an offset: from now on the program is not whole.
    pub fn begin_download(&mut self, offset: usize) {
        self.record(Worth::Incomplete);
        self.phase = Phase::Downloading { next: offset, failed: false };
    }

    /// Takes the next bytes of a download. False when they would lie outside the memory.
    pub fn download(&mut self, bytes: &[u8]) -> bool {
        let Phase::Downloading { next, .. } = &mut self.phase else { return false };
        let end = next.saturating_add(bytes.len());
        if end > M::Program::LENGTH {
            return false;
        }
        self.program.write(core::mem::replace(next, end), bytes);
        true
    }

    /// Ends a download: when all is written, the program is whole.
    pub fn end_download(&mut self) {
        if self.downloading().is_some() {
            self.phase = Phase::Closing;
            self.advance();
        }
    }

    /// Erases the program, and then gives [`Layout::after_erasing`] a value, 0..=3. The intent is recorded first: what is to be
    /// hidden is never seen again. If there is nothing left to erase, gives the value that the slot has got already.
    #[must_use]
    pub fn erase(&mut self, value: i32) -> Option<i32> {
        self.record(Worth::Erasing(value));
        self.phase = Phase::Intending;
        self.advance()
    }

    /// True when what is wanted is durable.
    pub fn settled(&self, need: Need) -> bool {
        let busy = !matches!(self.phase, Phase::Idle | Phase::Downloading { .. });
        self.settings.settled() && !(busy && need == Need::Program)
    }

    /// The next page to write; until [`Store::finish`] there is no other.
    pub fn next_job(&mut self) -> Option<Job> {
        if self.program.in_flight() {
            return None;
        }
        // The settings go first: they say what the program is worth.
        if !self.settings.settled() {
            return self.settings.next_job();
        }
        let end = match self.phase {
            Phase::Downloading { next, failed: false } => next,
            Phase::Closing | Phase::Erasing => usize::MAX,
            Phase::Idle | Phase::Sealing | Phase::Intending | Phase::Downloading { .. } => return None,
        };
        self.program.next_job(end)
    }

    /// The page handed out last is durable, or could not be written. Then what needed it has failed; of the
    /// settings all that is not durable is given up, so that what is stored and what reads as stored stay the
    /// same.
    pub fn finish(&mut self, written: bool) -> Finished {
        let failed = if self.program.finish(written) {
            (!written).then_some(Need::Program)
        } else {
            self.settings.finish(written);
            (!written).then_some(Need::Settings)
        };
        let mut erased = None;
        match (failed, self.phase) {
            (None, _) => erased = self.advance(),
            // Tried again at the end of the download.
            (Some(Need::Program), Phase::Downloading { next, .. }) => {
                self.phase = Phase::Downloading { next, failed: true };
            }
            (Some(Need::Settings), Phase::Downloading { .. }) if self.recorded() == Worth::Incomplete => {}
            (Some(_), _) => self.phase = Phase::Idle,
        }
        Finished { failed, erased }
    }

    /// Goes on to what has become possible. If the program is erased now, gives the value that a slot has got by that.
    fn advance(&mut self) -> Option<i32> {
        if self.phase == Phase::Intending && self.settings.settled() {
            self.program.erase();
            self.phase = Phase::Erasing;
        }
        let sum = self.program.sum()?;
        match (self.phase, self.recorded()) {
            (Phase::Closing, _) => {
                self.phase = Phase::Sealing;
                self.settings.set(SUM, sum.cast_signed());
                self.record(Worth::Whole);
            }
            (Phase::Sealing, _) if self.settings.settled() => {
                self.phase = Phase::Idle;
            }
            (Phase::Erasing, Worth::Erasing(value)) => {
                self.settings.set(M::LAYOUT.after_erasing, value);
                self.record(Worth::Empty);
                self.phase = Phase::Idle;
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
