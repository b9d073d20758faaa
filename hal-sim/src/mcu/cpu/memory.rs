//! The memories: flash, RAM, and the device's signature.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Where the memories are (RM0090 2.3).
pub(super) const FLASH: u32 = 0x0800_0000;
pub(super) const SRAM: u32 = 0x2000_0000;
pub(super) const CCM: u32 = 0x1000_0000;
/// Signature of the device: identity, flash size (RM0090 39).
const SIGNATURE: u32 = 0x1FFF_7A00;

/// Bytes of flash memory.
pub(in crate::mcu) const FLASH_SIZE: usize = 0x10_0000;
/// Bytes of SRAM1 and SRAM2.
pub(in crate::mcu) const SRAM_SIZE: usize = 0x2_0000;
const CCM_SIZE: usize = 0x1_0000;

/// The byte that fills SRAM after power-on, so that the part of the stack that was never used can be told.
const PAINT: u8 = 0xA5;

/// RAM, as the core, the DMA controllers and a debug probe see it. Clones are the same memory. It is in words that
/// can be shared; nothing is shared at the same time, so that plain loads and stores do.
#[derive(Clone, Debug)]
pub(in crate::mcu) struct Ram {
    base: u32,
    words: Arc<[AtomicU32]>,
}

impl Ram {
    fn new(base: u32, size: usize, fill: u8) -> Self {
        let words = std::iter::repeat_with(|| AtomicU32::new(u32::from_le_bytes([fill; 4])));
        Self { base, words: words.take(size / 4).collect() }
    }

    /// SRAM after power-on.
    pub(in crate::mcu) fn sram() -> Self {
        Self::new(SRAM, SRAM_SIZE, PAINT)
    }

    /// The core-coupled memory after power-on.
    pub(super) fn coupled() -> Self {
        Self::new(CCM, CCM_SIZE, 0)
    }

    /// Reads 1, 2 or 4 bytes; none if they are not all there.
    #[inline]
    pub(super) fn load(&self, address: u32, bytes: u32) -> Option<u32> {
        let at = address.wrapping_sub(self.base);
        let (word, shift) = ((at / 4) as usize, at % 4 * 8);
        let low = self.words.get(word)?.load(Ordering::Relaxed) >> shift;
        let value = if at % 4 + bytes <= 4 {
            low
        } else {
            low | self.words.get(word + 1)?.load(Ordering::Relaxed) << (32 - shift)
        };
        Some(value & mask(bytes))
    }

    /// Writes 1, 2 or 4 bytes; none if they do not all have a place, and then nothing is written.
    #[inline]
    pub(super) fn store(&self, address: u32, bytes: u32, value: u32) -> Option<()> {
        let at = address.wrapping_sub(self.base);
        let (word, shift) = ((at / 4) as usize, at % 4 * 8);
        let low = self.words.get(word)?;
        if bytes == 4 && shift == 0 {
            low.store(value, Ordering::Relaxed);
            return Some(());
        }
        let merge = |cell: &AtomicU32, mask: u32, value: u32| {
            cell.store(cell.load(Ordering::Relaxed) & !mask | value & mask, Ordering::Relaxed);
        };
        if at % 4 + bytes > 4 {
            let rest = 32 - shift;
            merge(self.words.get(word + 1)?, mask(bytes) >> rest, value >> rest);
        }
        merge(low, mask(bytes) << shift, value << shift);
        Some(())
    }

    /// Reads bytes; none if they are not all there.
    pub(in crate::mcu) fn read(&self, address: u32, to: &mut [u8]) -> Option<()> {
        for (at, byte) in (address..).zip(to) {
            *byte = self.load(at, 1)? as u8;
        }
        Some(())
    }

    /// Writes bytes; none if they are not all there.
    pub(in crate::mcu) fn write(&self, address: u32, from: &[u8]) -> Option<()> {
        for (at, &byte) in (address..).zip(from) {
            self.store(at, 1, byte.into())?;
        }
        Some(())
    }

    /// Reads a word.
    pub(in crate::mcu) fn word(&self, address: u32) -> Option<u32> {
        self.load(address, 4)
    }

    /// Forgets the contents, of which power-off leaves nothing.
    pub(in crate::mcu) fn forget(&self) {
        for word in self.words.iter() {
            word.store(u32::from_le_bytes([PAINT; 4]), Ordering::Relaxed);
        }
    }

    /// How many bytes at the end of a part of memory have been written since power-on.
    pub(in crate::mcu) fn used_in(&self, part: core::ops::Range<u32>) -> u32 {
        let paint = u32::from_le_bytes([PAINT; 4]);
        let end = part.end;
        let untouched = (part.start.next_multiple_of(4)..end).step_by(4).find(|&at| self.word(at) != Some(paint));
        untouched.map_or(0, |at| end - at)
    }
}

/// The lowest 1, 2 or 4 bytes of a word.
#[inline]
pub(super) const fn mask(bytes: u32) -> u32 {
    u32::MAX >> (32 - 8 * bytes)
}

/// All memories.
#[derive(Debug)]
pub(super) struct Memory {
    pub(super) sram: Ram,
    coupled: Ram,
    flash: Vec<u8>,
    signature: Vec<u8>,
}

impl Memory {
    /// Memories after power-on, with `flash` as the contents of the flash memory.
    pub(super) fn new(flash: Vec<u8>) -> Self {
        Self { sram: Ram::sram(), coupled: Ram::coupled(), flash, signature: signature() }
    }

    /// Reads 1, 2 or 4 bytes; none where there is no memory.
    #[inline]
    pub(super) fn load(&self, address: u32, bytes: u32) -> Option<u32> {
        if address >= SRAM {
            return self.sram.load(address, bytes);
        }
        if let Some(at) = flash_offset(address) {
            return bytes_at(&self.flash, at, bytes);
        }
        self.coupled.load(address, bytes).or_else(|| {
            let at = address.checked_sub(SIGNATURE)?;
            bytes_at(&self.signature, at as usize, bytes)
        })
    }

    /// Writes 1, 2 or 4 bytes; none where there is no RAM.
    #[inline]
    pub(super) fn store(&self, address: u32, bytes: u32, value: u32) -> Option<()> {
        if address >= SRAM {
            return self.sram.store(address, bytes, value);
        }
        self.coupled.store(address, bytes, value)
    }

    /// Programs the flash memory from `address` on. Gives what was there; none if it is not all flash memory.
    pub(super) fn program(&mut self, address: u32, bytes: &[u8]) -> Option<Vec<u8>> {
        let start = address.checked_sub(FLASH)? as usize;
        let cells = self.flash.get_mut(start..start.checked_add(bytes.len())?)?;
        let before = cells.to_vec();
        cells.copy_from_slice(bytes);
        Some(before)
    }
}

/// Where in the flash memory an address is. The boot pins select flash: it is at address 0, too.
#[inline]
pub(super) fn flash_offset(address: u32) -> Option<usize> {
    let offset = if address >= FLASH { address - FLASH } else { address } as usize;
    (offset < FLASH_SIZE).then_some(offset)
}

/// Whether an address leads to the flash memory.
#[inline]
pub(super) fn is_flash(address: u32) -> bool {
    flash_offset(address).is_some()
}

#[inline]
fn bytes_at(memory: &[u8], at: usize, bytes: u32) -> Option<u32> {
    let from = memory.get(at..)?;
    if let Some(word) = from.first_chunk() {
        return Some(u32::from_le_bytes(*word) & mask(bytes));
    }
    Some(from.get(..bytes as usize)?.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte)))
}

/// 0x1FFF_7A10: a 96-bit identity; 0x1FFF_7A22: the flash memory's size in KiB.
fn signature() -> Vec<u8> {
    let mut bytes = vec![0xFF; 0x30];
    let words = [0x0026_0038, 0x3433_510D, 0x3931_3234_u32];
    for (place, word) in words.into_iter().enumerate() {
        bytes[0x10 + 4 * place..][..4].copy_from_slice(&word.to_le_bytes());
    }
    bytes[0x22..0x24].copy_from_slice(&((FLASH_SIZE / 1024) as u16).to_le_bytes());
    bytes
}
