//! Program memory: what the interpreter reads, and which pages of it are not in the EEPROM yet.
//!
//! The bytes lie in the EEPROM inverted, so that an erased part is an empty program: command number 0, which
//! ends it, everywhere.

use crc::{CRC_32_AIXM, Crc, NoTable};

use super::page::{Image, Job, SETTINGS};
use crate::chip::at25::{PAGE, SIZE};
use crate::tmcl::Command;

/// Commands in program memory (manual section 3.3).
pub const COMMANDS: u16 = 2048;

const BYTES: usize = COMMANDS as usize * Command::SIZE;
const PAGES: usize = BYTES / PAGE;
/// Pages as bits, 32 to a word.
const WORDS: usize = PAGES / 32;

const _: () = assert!(BYTES + SETTINGS as usize == SIZE as usize && BYTES == PAGES * PAGE && PAGES == WORDS * 32);

/// Without a start value or a final inversion: a page of zeros counts zero.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_AIXM);

/// The commands, and what is still to be written of them.
#[derive(Debug)]
pub(super) struct Program {
    bytes: [u8; BYTES],
    /// Pages whose copy in the EEPROM is another.
    dirty: [u32; WORDS],
    /// Check sum over all pages that are not dirty; see [`weigh`].
    sum: u32,
    in_flight: Option<usize>,
}

impl Program {
    pub(super) const fn new() -> Self {
        Program { bytes: [0; _], dirty: [0; _], sum: 0, in_flight: None }
    }

    /// Reads the whole memory through `read(address, page)`.
    pub(super) fn load<E>(&mut self, mut read: impl FnMut(u16, &mut Image) -> Result<(), E>) -> Result<(), E> {
        self.forget();
        let (pages, _) = self.bytes.as_chunks_mut();
        for (index, page) in pages.iter_mut().enumerate() {
            read(address(index), page)?;
            invert(page);
            self.sum = self.sum.wrapping_add(weigh(index, page));
        }
        Ok(())
    }

    /// An empty memory, durable as it is. In place: it is too large for the stack.
    pub(super) fn forget(&mut self) {
        let Program { bytes, dirty, sum, in_flight } = self;
        bytes.fill(0);
        (*dirty, *sum, *in_flight) = ([0; _], 0, None);
    }

    /// The command at an address; `None` outside the memory.
    pub(super) fn command(&self, address: u16) -> Option<Command> {
        let (commands, _) = self.bytes.as_chunks();
        commands.get(usize::from(address)).map(|bytes| Command::from_bytes(*bytes))
    }

    /// Changes a command; what is the same already is not written again.
    pub(super) fn write(&mut self, address: u16, command: Command) {
        let first = usize::from(address).saturating_mul(Command::SIZE);
        for (offset, byte) in (first..).zip(command.to_bytes()) {
            if self.bytes.get(offset).is_some_and(|old| *old != byte) {
                self.touch(offset / PAGE);
                if let Some(place) = self.bytes.get_mut(offset) {
                    *place = byte;
                }
            }
        }
    }

    /// Empties the memory. Pages that are empty in the EEPROM already are not written.
    pub(super) fn erase(&mut self) {
        let (pages, _) = self.bytes.as_chunks_mut::<PAGE>();
        for (index, page) in pages.iter_mut().enumerate() {
            if *page != [0; PAGE] {
                *page = [0; PAGE];
                set(&mut self.dirty, index, true);
            }
        }
        self.sum = 0;
    }

    /// Check sum of the memory; `None` while a page is not in the EEPROM.
    pub(super) fn sum(&self) -> Option<u32> {
        (self.in_flight.is_none() && self.dirty == [0; _]).then_some(self.sum)
    }

    /// The next page to be written: the first dirty one before `end`, a byte offset.
    pub(super) fn next_job(&mut self, end: usize) -> Option<Job> {
        if self.in_flight.is_some() {
            return None;
        }
        let word = self.dirty.iter().position(|word| *word != 0)?;
        let bit = usize::try_from(self.dirty.get(word)?.trailing_zeros()).ok()?;
        let index = word.saturating_mul(32).saturating_add(bit);
        if index.saturating_add(1).saturating_mul(PAGE) > end {
            return None;
        }
        let mut page = *self.page(index)?;
        set(&mut self.dirty, index, false);
        self.sum = self.sum.wrapping_add(weigh(index, &page));
        self.in_flight = Some(index);
        invert(&mut page);
        Some(Job { address: address(index), page })
    }

    /// True while a page is on its way.
    pub(super) const fn in_flight(&self) -> bool {
        self.in_flight.is_some()
    }

    /// The page handed out last is in the EEPROM, or could not be written. False if it was none of these.
    pub(super) fn finish(&mut self, written: bool) -> bool {
        let Some(index) = self.in_flight.take() else { return false };
        if !written {
            self.touch(index);
        }
        true
    }

    fn touch(&mut self, index: usize) {
        if let Some(page) = self.page(index) {
            let weight = weigh(index, page);
            if set(&mut self.dirty, index, true) {
                self.sum = self.sum.wrapping_sub(weight);
            }
        }
    }

    fn page(&self, index: usize) -> Option<&Image> {
        let (pages, _) = self.bytes.as_chunks();
        pages.get(index)
    }
}

/// A page's share of the check sum. The factors are odd and different, so that no two pages can change places.
fn weigh(index: usize, page: &Image) -> u32 {
    let factor = (index as u32).wrapping_mul(2).wrapping_add(1);
    CRC.checksum(page).wrapping_mul(factor)
}

fn address(index: usize) -> u16 {
    index.saturating_mul(PAGE) as u16
}

fn invert(page: &mut Image) {
    for byte in page {
        *byte = !*byte;
    }
}

/// Sets or clears a page's bit; true if that changed it.
fn set(words: &mut [u32; WORDS], index: usize, on: bool) -> bool {
    let bit = 1_u32.wrapping_shl(index as u32);
    let Some(word) = words.get_mut(index / 32) else { return false };
    let before = *word;
    *word = if on { before | bit } else { before & !bit };
    *word != before
}
