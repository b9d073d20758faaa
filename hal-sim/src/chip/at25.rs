//! The EEPROM: an AT25128, 16 384 bytes behind SPI, written in pages of 64 bytes, or one of its larger sisters.
//!
//! From the datasheet: every write must be preceded by WREN. A WRITE of more bytes than the page holds wraps around
//! within the page. The internal write cycle starts when chip select rises after at least one data byte, and takes up
//! to 5 ms (this model always takes all of it). Until it ends only RDSR is answered - with all ones. The write enable
//! latch falls when the cycle ends. READ goes on through the whole memory and rolls over at its end. BP1/BP0 protect
//! the upper quarter, half or all of the memory. The write-protect pin is taken as tied high, so that WPEN is stored
//! and has no effect.
//!
//! A power cut during a write cycle tears the whole page, because the part erases and programs a page as a whole. Each
//! of its bytes is left old, new or erased, at random but reproducibly.

use core::fmt;
use core::ops::Range;

use super::SpiSlave;
use crate::clock::{MILLISECOND, Nanos};
use crate::random::Random;

/// The properties that distinguish the parts of the family. All of them are addressed by two bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Size of the memory in bytes, a power of two up to 65 536.
    pub size: usize,
    /// Size of a page in bytes, a power of two up to [`LARGEST_PAGE`].
    pub page: usize,
}

/// The part of the TMCM-1140.
pub const AT25128: Part = Part { size: 16_384, page: 64 };
/// A part twice as large as the AT25128.
pub const AT25256: Part = Part { size: 32_768, page: 64 };
/// A part four times as large as the AT25128, with pages of twice the length.
pub const AT25512: Part = Part { size: 65_536, page: 128 };

/// The largest page of the family in bytes.
pub const LARGEST_PAGE: usize = 128;
/// Time for which the part is busy after a WRITE or WRSR.
pub const WRITE_CYCLE: Nanos = 5 * MILLISECOND;

/// The value of an erased byte, and of a byte that is read from a bus without a driver.
const ERASED: u8 = 0xFF;

const WRSR: u8 = 0x01;
const WRITE: u8 = 0x02;
const READ: u8 = 0x03;
const WRDI: u8 = 0x04;
const RDSR: u8 = 0x05;
const WREN: u8 = 0x06;

const STATUS_WEN: u8 = 0x02;
const STATUS_BP: u8 = 0x0C;
const STATUS_WPEN: u8 = 0x80;
const STATUS_STORED: u8 = STATUS_WPEN | STATUS_BP;

/// The place, such as a file, where the contents are kept so that they outlive the model.
pub trait Backing: fmt::Debug + Send + Sync {
    /// Takes the contents as a page write leaves them. False if they cannot be kept: then the page keeps its old bytes,
    /// as in a part that is worn out, which reading them back shows.
    fn keep(&mut self, contents: &[u8]) -> bool;
}

/// The meaning of the bytes since the chip select fell.
#[derive(Clone, Debug)]
enum Transfer {
    Idle,
    Opcode,
    ReadStatus,
    WriteStatus(Option<u8>),
    Address { write: bool, high: Option<u8> },
    Read { at: usize },
    Write { at: usize, data: [u8; LARGEST_PAGE], given: u128 },
    Latch(bool),
    Ignored,
}

/// A write cycle under way.
#[derive(Clone, Debug)]
enum Programming {
    Page { page: usize, new: Vec<u8> },
    Status(u8),
}

/// The part, with its contents.
#[derive(Debug)]
pub struct At25 {
    part: Part,
    memory: Vec<u8>,
    page_writes: Vec<u32>,
    stored_status: u8,
    write_enabled: bool,
    transfer: Transfer,
    programming: Option<(Nanos, Programming)>,
    answering: bool,
    /// Bytes that have come so far, and those among them that the part neither hears nor answers.
    bytes: u64,
    silence: Range<u64>,
    backing: Option<Box<dyn Backing>>,
    random: Random,
}

impl At25 {
    /// A fresh part: all bytes 0xFF. `seed` decides how power cuts tear pages.
    pub fn new(part: Part, seed: u64) -> Self {
        Self {
            part,
            memory: vec![ERASED; part.size],
            page_writes: vec![0; part.size / part.page],
            stored_status: 0,
            write_enabled: false,
            transfer: Transfer::Idle,
            programming: None,
            answering: true,
            bytes: 0,
            silence: 0..0,
            backing: None,
            random: Random::new(seed),
        }
    }

    /// The contents as a reader sees them now: a page that is being written still has its old bytes.
    pub fn contents(&self) -> &[u8] {
        &self.memory
    }

    /// Replaces the contents from address 0 on. Contents beyond the length of `bytes` stay; bytes beyond the memory are
    /// ignored.
    pub fn load(&mut self, bytes: &[u8]) {
        for (cell, &byte) in self.memory.iter_mut().zip(bytes) {
            *cell = byte;
        }
    }

    /// Has the contents kept in `backing`: from now on a page is written only if `backing` has taken it. The present
    /// contents are not handed over.
    pub fn keep_in(&mut self, backing: Box<dyn Backing>) {
        self.backing = Some(backing);
    }

    /// Takes the backing back: from now on the contents are kept nowhere else.
    pub fn take_backing(&mut self) -> Option<Box<dyn Backing>> {
        self.backing.take()
    }

    /// The number of writes to a page, counted from 0; 0 for a page that does not exist.
    pub fn page_writes(&self, page: usize) -> u32 {
        self.page_writes.get(page).copied().unwrap_or(0)
    }

    /// The number of writes to the page that was written most (the part endures a million).
    pub fn most_page_writes(&self) -> u32 {
        self.page_writes.iter().copied().max().unwrap_or(0)
    }

    /// Whether a write cycle is under way.
    pub fn is_writing(&self) -> bool {
        self.programming.is_some()
    }

    /// The time at which the write cycle under way ends; `None` without one.
    pub fn next_event(&self) -> Option<Nanos> {
        self.programming.as_ref().map(|&(end, _)| end)
    }

    /// Lets time pass until `to`; a write cycle that ends by then takes effect.
    #[inline]
    pub fn advance(&mut self, to: Nanos) {
        if self.programming.as_ref().is_some_and(|&(end, _)| end <= to)
            && let Some((_, programming)) = self.programming.take()
        {
            match programming {
                Programming::Page { page, new } => self.replace(page, &new),
                Programming::Status(status) => self.stored_status = status,
            }
            self.write_enabled = false;
        }
    }

    /// Cuts the supply now. A page that is being written is left torn; the part comes back write-disabled.
    pub fn power_cut(&mut self) {
        match self.programming.take() {
            Some((_, Programming::Page { page, mut new })) => {
                let old = self.memory.iter().skip(page * self.part.page);
                for (new, old) in new.iter_mut().zip(old) {
                    match self.random.below(3) {
                        0 => *new = *old,
                        1 => {}
                        _ => *new = ERASED,
                    }
                }
                self.replace(page, &new);
            }
            Some((_, Programming::Status(status))) if self.random.below(2) == 1 => {
                self.stored_status = status;
            }
            _ => {}
        }
        self.write_enabled = false;
        self.transfer = Transfer::Idle;
    }

    /// Fault injection: with `false` the part takes no commands and leaves its output floating, which reads as ones.
    pub fn set_answering(&mut self, answering: bool) {
        self.answering = answering;
    }

    /// Fault injection: after so many bytes from now on the part falls silent, for so many bytes.
    pub fn fall_silent(&mut self, after: u64, bytes: u64) {
        let from = self.bytes.saturating_add(after);
        self.silence = from..from.saturating_add(bytes);
    }

    /// Fault injection: the part is busy until a time, as with a write that takes too long, and changes nothing.
    pub fn keep_busy(&mut self, until: Nanos) {
        self.programming = Some((until, Programming::Status(self.stored_status)));
    }

    /// Gives a page new bytes, unless the backing refuses them.
    fn replace(&mut self, page: usize, new: &[u8]) {
        let place = page * self.part.page..(page + 1) * self.part.page;
        let Some(cells) = self.memory.get_mut(place.clone()) else { return };
        let old = cells.to_vec();
        cells.copy_from_slice(new);
        let refused = self.backing.as_mut().is_some_and(|backing| !backing.keep(&self.memory));
        if refused && let Some(cells) = self.memory.get_mut(place) {
            cells.copy_from_slice(&old);
        }
    }

    fn status(&self) -> u8 {
        if self.is_writing() {
            return 0xFF;
        }
        self.stored_status | if self.write_enabled { STATUS_WEN } else { 0 }
    }

    /// The first address of the part that BP1/BP0 protect: nothing, the upper quarter, the upper half, or all of the
    /// memory.
    fn first_protected(&self) -> usize {
        match (self.stored_status & STATUS_BP) >> 2 {
            0 => self.part.size,
            1 => self.part.size / 4 * 3,
            2 => self.part.size / 2,
            _ => 0,
        }
    }

    fn begin(&mut self, opcode: u8) -> Transfer {
        if self.is_writing() && opcode != RDSR {
            return Transfer::Ignored;
        }
        match opcode {
            WREN => Transfer::Latch(true),
            WRDI => Transfer::Latch(false),
            RDSR => Transfer::ReadStatus,
            WRSR => Transfer::WriteStatus(None),
            READ => Transfer::Address { write: false, high: None },
            WRITE => Transfer::Address { write: true, high: None },
            _ => Transfer::Ignored,
        }
    }

    fn start_page(&mut self, now: Nanos, at: usize, data: &[u8], given: u128) {
        if given == 0 || !self.write_enabled || at >= self.first_protected() {
            return;
        }
        let page = at / self.part.page;
        let old = self.memory.iter().skip(page * self.part.page).take(self.part.page);
        let bytes = old.zip(data).enumerate();
        let new = bytes.map(|(place, (old, byte))| if given >> place & 1 == 0 { *old } else { *byte }).collect();
        if let Some(writes) = self.page_writes.get_mut(page) {
            *writes += 1;
        }
        self.programming = Some((now + WRITE_CYCLE, Programming::Page { page, new }));
    }
}

impl SpiSlave for At25 {
    fn select(&mut self, _now: Nanos) {
        self.transfer = if self.answering { Transfer::Opcode } else { Transfer::Ignored };
    }

    fn byte(&mut self, mosi: u8) -> u8 {
        let mut miso = ERASED;
        let transfer = core::mem::replace(&mut self.transfer, Transfer::Ignored);
        let at = self.bytes;
        self.bytes += 1;
        if self.silence.contains(&at) {
            return ERASED;
        }
        self.transfer = match transfer {
            Transfer::Opcode => self.begin(mosi),
            Transfer::ReadStatus => {
                miso = self.status();
                Transfer::ReadStatus
            }
            Transfer::WriteStatus(_) => Transfer::WriteStatus(Some(mosi)),
            Transfer::Address { write, high: None } => Transfer::Address { write, high: Some(mosi) },
            Transfer::Address { write, high: Some(high) } => {
                let at = usize::from(u16::from_be_bytes([high, mosi])) & (self.part.size - 1);
                if write {
                    Transfer::Write { at, data: [ERASED; LARGEST_PAGE], given: 0 }
                } else {
                    Transfer::Read { at }
                }
            }
            Transfer::Read { at } => {
                miso = self.memory.get(at).copied().unwrap_or(ERASED);
                Transfer::Read { at: (at + 1) & (self.part.size - 1) }
            }
            Transfer::Write { at, mut data, mut given } => {
                let place = at % self.part.page;
                if let Some(byte) = data.get_mut(place) {
                    *byte = mosi;
                }
                given |= 1 << place;
                Transfer::Write { at: at - place + (place + 1) % self.part.page, data, given }
            }
            // After a further byte the chip select does not rise where the command ends, so the command is ignored.
            Transfer::Latch(_) | Transfer::Ignored => Transfer::Ignored,
            Transfer::Idle => Transfer::Idle,
        };
        miso
    }

    fn deselect(&mut self, now: Nanos) {
        match core::mem::replace(&mut self.transfer, Transfer::Idle) {
            Transfer::Latch(enabled) => self.write_enabled = enabled,
            Transfer::Write { at, data, given } => self.start_page(now, at, &data, given),
            Transfer::WriteStatus(Some(status)) if self.write_enabled => {
                self.programming = Some((now + WRITE_CYCLE, Programming::Status(status & STATUS_STORED)));
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
