//! What survives power-off: the program in the first 14 336 bytes of the EEPROM, the settings in the last 2 048.
//!
//! A setting has a [`Slot`]; 14 slots make a page of 64 bytes. Each page exists twice and the two copies are
//! written in turn, with a sequence number and a CRC: a write cut short leaves the older copy. A factory
//! reset is one page write, too: it begins a new epoch, and pages of an older one count no more.
//!
//! The program exists once. Two slots say what it is worth: whether it is whole, and its check sum. They change
//! before the first of its pages and after the last one, so that a download cut short is known as such.
//!
//! Nothing in here touches the part. [`Store`] knows what is durable and what is wanted, and hands out page
//! writes one at a time; the [`Keeper`] carries them out beside everything else.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod keeper;
mod layout;
mod page;
mod program;
mod settings;

pub use keeper::Keeper;
pub use layout::{AXES_MAX, Slot};
pub use page::{Job, PAGES, SETTINGS};
pub use program::COMMANDS;

use crate::param::{AGAINST_READING, GlobalParameter};
use crate::tmcl::Command;
use page::Image;
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
    /// The program is to be erased, and then parameter 81 gets this value.
    Erasing(i32),
}

impl Worth {
    /// Added to the value for parameter 81.
    const ERASING: i32 = 4;

    fn from_slot(value: i32) -> Self {
        match value {
            0 => Worth::Empty,
            1 => Worth::Whole,
            4..=7 => Worth::Erasing(value & 3),
            _ => Worth::Incomplete,
        }
    }

    fn to_slot(self) -> i32 {
        match self {
            Worth::Empty => 0,
            Worth::Whole => 1,
            Worth::Incomplete => 2,
            Worth::Erasing(protection) => Worth::ERASING | protection,
        }
    }
}

/// What goes on with program memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    /// Commands come in, the next one to this address; pages before it are written behind.
    Downloading {
        next: u16,
        failed: bool,
    },
    /// All pages are written, then the program counts as whole.
    Closing,
    /// As soon as it is recorded that the program is whole, it is.
    Sealing,
    /// As soon as the intent is durable the memory is emptied.
    Intending,
    /// All pages are written, then the program counts as gone and parameter 81 changes.
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

/// The settings and the program, as they are in the EEPROM and as they shall be.
#[derive(Debug)]
pub struct Store {
    settings: Settings,
    program: Program,
    phase: Phase,
}

impl Default for Store {
    fn default() -> Self {
        Self::new()
    }
}

impl Store {
    /// A store that has not been filled: see [`Store::forget`] and [`Store::load`]. All zeros, so that it may be a
    /// static without a copy in the flash.
    pub const fn new() -> Self {
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
    pub fn load<E>(&mut self, mut read: impl FnMut(u16, &mut Image) -> Result<(), E>) -> Result<Report, E> {
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
    pub fn get(&self, slot: Slot) -> Option<i32> {
        self.settings.get(slot)
    }

    /// Wants a value in a slot. What is there already is not written again.
    pub fn set(&mut self, slot: Slot, value: i32) {
        self.settings.set(slot, value);
    }

    /// Wants factory defaults everywhere. The program stays, unless it is protected against being read.
    pub fn reset(&mut self) {
        let protection = self.get(Slot::Global(GlobalParameter::CodeProtection)).unwrap_or_default();
        let worth = if protection & AGAINST_READING != 0 { Worth::Erasing(0) } else { self.worth() };
        let sum = self.get(Slot::ProgramSum).unwrap_or_default();
        self.settings.reset();
        // Both are in the page that begins the new epoch.
        self.settings.set(Slot::ProgramState, worth.to_slot());
        self.settings.set(Slot::ProgramSum, sum);
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
        self.program.sum().map(u32::cast_signed) == self.get(Slot::ProgramSum)
    }

    /// What the slot says of it.
    fn recorded(&self) -> Worth {
        Worth::from_slot(self.get(Slot::ProgramState).unwrap_or_default())
    }

    /// The command at an address of program memory; `None` outside.
    pub fn command(&self, address: u16) -> Option<Command> {
        self.program.command(address)
    }

    /// Where the next command of a download goes, while there is one.
    pub fn downloading(&self) -> Option<u16> {
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

    /// Begins a download: from now on the program is not whole.
    pub fn begin_download(&mut self, address: u16) {
        self.set(Slot::ProgramState, Worth::Incomplete.to_slot());
        self.phase = Phase::Downloading { next: address, failed: false };
    }

    /// Takes the next command of a download. False when it would lie outside the memory.
    pub fn download(&mut self, command: Command) -> bool {
        let Phase::Downloading { next, .. } = &mut self.phase else { return false };
        if *next >= COMMANDS {
            return false;
        }
        self.program.write(*next, command);
        *next = next.saturating_add(1);
        true
    }

    /// Ends a download: when all is written, the program is whole.
    pub fn end_download(&mut self) {
        if self.downloading().is_some() {
            self.phase = Phase::Closing;
            self.advance();
        }
    }

    /// Erases the program, and then gives parameter 81 this value. The intent is recorded first: what is to be
    /// hidden is never seen again.
    pub fn erase(&mut self, protection: i32) {
        self.set(Slot::ProgramState, Worth::Erasing(protection).to_slot());
        self.phase = Phase::Intending;
        self.advance();
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
            Phase::Downloading { next, failed: false } => usize::from(next).saturating_mul(Command::SIZE),
            Phase::Closing | Phase::Erasing => usize::MAX,
            Phase::Idle | Phase::Sealing | Phase::Intending | Phase::Downloading { .. } => return None,
        };
        self.program.next_job(end)
    }

    /// The page handed out last is durable, or could not be written. Then what needed it has failed; of the
    /// settings all that is not durable is given up, so that what is stored and what reads as stored stay the
    /// same. Tells what has failed.
    pub fn finish(&mut self, written: bool) -> Option<Need> {
        let failed = if self.program.finish(written) {
            (!written).then_some(Need::Program)
        } else {
            self.settings.finish(written);
            (!written).then_some(Need::Settings)
        };
        match (failed, self.phase) {
            (None, _) => self.advance(),
            // Tried again at the end of the download.
            (Some(Need::Program), Phase::Downloading { next, .. }) => {
                self.phase = Phase::Downloading { next, failed: true };
            }
            (Some(Need::Settings), Phase::Downloading { .. }) if self.recorded() == Worth::Incomplete => {}
            (Some(_), _) => self.phase = Phase::Idle,
        }
        failed
    }

    /// Goes on to what has become possible.
    fn advance(&mut self) {
        if self.phase == Phase::Intending && self.settings.settled() {
            self.program.erase();
            self.phase = Phase::Erasing;
        }
        let Some(sum) = self.program.sum() else { return };
        match (self.phase, self.recorded()) {
            (Phase::Closing, _) => {
                self.phase = Phase::Sealing;
                self.settings.set(Slot::ProgramSum, sum.cast_signed());
                self.settings.set(Slot::ProgramState, Worth::Whole.to_slot());
            }
            (Phase::Sealing, _) if self.settings.settled() => {
                self.phase = Phase::Idle;
            }
            (Phase::Erasing, Worth::Erasing(protection)) => {
                self.settings.set(Slot::Global(GlobalParameter::CodeProtection), protection);
                self.settings.set(Slot::ProgramState, Worth::Empty.to_slot());
                self.phase = Phase::Idle;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects)]
mod tests;
