//! Program memory: the bytes that the interpreter reads from RAM, and which of their pages are not in the EEPROM yet.
//!
//! The bytes lie in the EEPROM inverted, because an erased EEPROM (0xFF everywhere) is to read as an empty program (0).

use crc::{CRC_32_AIXM, Crc, NoTable};

use super::memory::{Array, Memory, PROGRAM_PAGES};
use super::page::{Job, Page};

/// Words of a set of pages: one bit a page, 32 bits a word.
const WORDS: usize = PROGRAM_PAGES / 32;

/// A CRC with neither a start value nor a final inversion, so the check sum of a page of zeros is 0.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_AIXM);

/// Program memory, and which of its pages are still to be written.
#[derive(Debug)]
pub(super) struct Program<M: Memory> {
    bytes: M::Program,
    /// Pages, one bit each, whose bytes in the EEPROM differ.
    dirty: [u32; WORDS],
    /// Sum of [`weigh`] over all pages that are not dirty.
    sum: u32,
    /// The page handed out by [`Program::next_job`] and not finished yet.
    in_flight: Option<usize>,
}

impl<M: Memory> Program<M> {
    pub(super) const fn new() -> Self {
        Program { bytes: M::Program::ZEROS, dirty: [0; _], sum: 0, in_flight: None }
    }

    /// Reads program memory from the EEPROM through `read(address, page)`.
    pub(super) fn load<E>(&mut self, mut read: impl FnMut(u16, &mut [u8]) -> Result<(), E>) -> Result<(), E> {
        self.forget();
        for (index, page) in self.bytes.as_mut().chunks_exact_mut(M::PAGE).enumerate() {
            read(address::<M>(index), page)?;
            invert(page);
            self.sum = self.sum.wrapping_add(weigh(index, page));
        }
        Ok(())
    }

    /// Empties the memory, as with a fresh EEPROM: no page is to be written. The fields are cleared one by one,
    /// because a new value would not fit the stack.
    pub(super) fn forget(&mut self) {
        let Program { bytes, dirty, sum, in_flight } = self;
        bytes.as_mut().fill(0);
        (*dirty, *sum, *in_flight) = ([0; _], 0, None);
    }

    pub(super) fn bytes(&self) -> &[u8] {
        self.bytes.as_ref()
    }

    /// Changes bytes from a byte offset on; pages whose bytes stay the same are not written again.
    pub(super) fn write(&mut self, offset: usize, bytes: &[u8]) {
        for (offset, byte) in (offset..).zip(bytes) {
            if self.bytes().get(offset).is_some_and(|old| old != byte) {
                self.touch(offset.checked_div(M::PAGE).unwrap_or_default());
                if let Some(stored) = self.bytes.as_mut().get_mut(offset) {
                    *stored = *byte;
                }
            }
        }
    }

    /// Empties the memory. Pages that are empty in the EEPROM already are not written.
    pub(super) fn erase(&mut self) {
        for (index, page) in self.bytes.as_mut().chunks_exact_mut(M::PAGE).enumerate() {
            if page.iter().any(|byte| *byte != 0) {
                page.fill(0);
                set(&mut self.dirty, index, true);
            }
        }
        self.sum = 0;
    }

    /// Check sum of program memory; `None` while any page is not in the EEPROM yet.
    pub(super) fn sum(&self) -> Option<u32> {
        (self.in_flight.is_none() && self.dirty == [0; _]).then_some(self.sum)
    }

    /// The next page to be written: the first dirty page that ends at or before the byte offset `end`.
    pub(super) fn next_job(&mut self, end: usize) -> Option<Job> {
        if self.in_flight.is_some() {
            return None;
        }
        let word = self.dirty.iter().position(|word| *word != 0)?;
        let bit = usize::try_from(self.dirty.get(word)?.trailing_zeros()).ok()?;
        let index = word.saturating_mul(32).saturating_add(bit);
        if index.saturating_add(1).saturating_mul(M::PAGE) > end {
            return None;
        }
        let bytes = self.page(index)?;
        let (weight, mut page) = (weigh(index, bytes), Page::from_slice(bytes).ok()?);
        set(&mut self.dirty, index, false);
        self.sum = self.sum.wrapping_add(weight);
        self.in_flight = Some(index);
        invert(&mut page);
        Some(Job { address: address::<M>(index), page })
    }

    /// True while a page has been handed out and not finished.
    pub(super) const fn in_flight(&self) -> bool {
        self.in_flight.is_some()
    }

    /// Reports that the page handed out last is durable (`written`), or could not be written. False if the program has
    /// handed out no page.
    pub(super) fn finish(&mut self, written: bool) -> bool {
        let Some(index) = self.in_flight.take() else { return false };
        if !written {
            self.touch(index);
        }
        true
    }

    /// Marks a page as dirty and takes its share out of the check sum.
    fn touch(&mut self, index: usize) {
        if let Some(page) = self.page(index) {
            let weight = weigh(index, page);
            if set(&mut self.dirty, index, true) {
                self.sum = self.sum.wrapping_sub(weight);
            }
        }
    }

    fn page(&self, index: usize) -> Option<&[u8]> {
        let first = index.saturating_mul(M::PAGE);
        self.bytes().get(first..first.saturating_add(M::PAGE))
    }
}

/// A page's share of the check sum. Each page has its own odd factor, so that swapping two pages changes the sum.
fn weigh(index: usize, page: &[u8]) -> u32 {
    let factor = (index as u32).wrapping_mul(2).wrapping_add(1);
    CRC.checksum(page).wrapping_mul(factor)
}

fn address<M: Memory>(index: usize) -> u16 {
    index.saturating_mul(M::PAGE) as u16
}

fn invert(page: &mut [u8]) {
    for byte in page {
        *byte = !*byte;
    }
}

/// Sets or clears the bit of a page; true if the bit changed.
fn set(words: &mut [u32; WORDS], index: usize, on: bool) -> bool {
    let bit = 1_u32.wrapping_shl(index as u32);
    let Some(word) = words.get_mut(index / 32) else { return false };
    let before = *word;
    *word = if on { before | bit } else { before & !bit };
    *word != before
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of CRC-32/AIXM, that of the nine digits, is 3010BF7Fh; the first page counts once, each further
    /// one two times more. EEPROMs in the field have sums that were made so.
    #[test]
    fn pages_have_their_shares_of_the_check_sum() {
        const DIGITS: u32 = 0x3010_BF7F;
        for (index, factor) in [(0, 1), (1, 3), (2, 5), (223, 447)] {
            assert_eq!(weigh(index, b"123456789"), DIGITS.wrapping_mul(factor), "page {index}");
        }
        assert_eq!(weigh(7, &[0; 64]), 0);
    }
}
