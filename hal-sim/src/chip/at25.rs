//! The EEPROM: AT25128, 16 384 bytes behind SPI, written in pages of 64 bytes.
//!
//! From the datasheet: every write must be preceded by WREN; a WRITE of more bytes than the page holds
//! wraps around within the page; the internal write cycle starts when chip select rises after at least one
//! data byte, takes up to 5 ms (this model always takes all of it), and until it ends only RDSR is
//! answered - with all ones. The write enable latch falls when the cycle ends. READ goes on through the
//! whole memory and rolls over at its end. BP1/BP0 protect the upper quarter, half or all of the memory.
//! The write-protect pin is taken as tied high, so that WPEN is stored and has no effect.
//!
//! A power cut during a write cycle tears the whole page: each of its bytes is left old, new or erased,
//! at random but reproducibly, because the part erases and programs a page as a whole.

use core::fmt;

use super::SpiSlave;
use crate::clock::{MILLISECOND, Nanos};
use crate::random::Random;

/// Size of the memory in bytes.
pub const SIZE: usize = 16_384;
/// Size of a page in bytes.
pub const PAGE: usize = 64;
/// How long the part is busy after a WRITE or WRSR.
pub const WRITE_CYCLE: Nanos = 5 * MILLISECOND;

/// What an erased byte reads, and what a bus without driver reads.
const ERASED: u8 = 0xFF;
const ADDRESS_MASK: usize = SIZE - 1;

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

/// Where the contents are kept so that they outlive the model, such as a file.
pub trait Backing: fmt::Debug + Send + Sync {
    /// Takes the contents as a page write leaves them. False if they cannot be kept: then the page keeps its old bytes,
    /// as that of a part which is worn out, and whoever reads it back notices.
    fn keep(&mut self, contents: &[u8]) -> bool;
}

/// What the bytes since chip select fell have meant so far.
#[derive(Clone, Debug)]
enum Transfer {
    Idle,
    Opcode,
    ReadStatus,
    WriteStatus(Option<u8>),
    Address { write: bool, high: Option<u8> },
    Read { at: usize },
    Write { at: usize, data: [u8; PAGE], given: u64 },
    Latch(bool),
    Ignored,
}

/// A write cycle under way.
#[derive(Clone, Debug)]
enum Programming {
    Page { page: usize, new: [u8; PAGE] },
    Status(u8),
}

/// The part, with its contents.
#[derive(Debug)]
pub struct At25 {
    memory: Vec<u8>,
    page_writes: Vec<u32>,
    stored_status: u8,
    write_enabled: bool,
    transfer: Transfer,
    programming: Option<(Nanos, Programming)>,
    answering: bool,
    backing: Option<Box<dyn Backing>>,
    random: Random,
}

impl At25 {
    /// A fresh part: all bytes 0xFF. `seed` decides how power cuts tear pages.
    pub fn new(seed: u64) -> Self {
        Self {
            memory: vec![ERASED; SIZE],
            page_writes: vec![0; SIZE / PAGE],
            stored_status: 0,
            write_enabled: false,
            transfer: Transfer::Idle,
            programming: None,
            answering: true,
            backing: None,
            random: Random::new(seed),
        }
    }

    /// The contents as a reader would see them now; a page being written still has its old bytes.
    pub fn contents(&self) -> &[u8] {
        &self.memory
    }

    /// Replaces the contents, starting at address 0. What `bytes` does not cover stays, what exceeds the
    /// memory is ignored.
    pub fn load(&mut self, bytes: &[u8]) {
        for (cell, &byte) in self.memory.iter_mut().zip(bytes) {
            *cell = byte;
        }
    }

    /// From now on a page is written when `backing` has taken it, and not otherwise. The contents up to now are its
    /// owner's business.
    pub fn keep_in(&mut self, backing: Box<dyn Backing>) {
        self.backing = Some(backing);
    }

    /// How often page `page` (0..=255) has been written; 0 for a page that does not exist.
    pub fn page_writes(&self, page: usize) -> u32 {
        self.page_writes.get(page).copied().unwrap_or(0)
    }

    /// The largest number of writes any page has seen (the part endures a million).
    pub fn most_page_writes(&self) -> u32 {
        self.page_writes.iter().copied().max().unwrap_or(0)
    }

    /// Whether a write cycle is under way.
    pub fn is_writing(&self) -> bool {
        self.programming.is_some()
    }

    /// When the write cycle under way ends.
    pub fn next_event(&self) -> Option<Nanos> {
        self.programming.as_ref().map(|&(end, _)| end)
    }

    /// Lets time pass until `to`; a write cycle that ends by then takes effect.
    pub fn advance(&mut self, to: Nanos) {
        if self.programming.as_ref().is_some_and(|&(end, _)| end <= to)
            && let Some((_, programming)) = self.programming.take()
        {
            match programming {
                Programming::Page { page, new } => self.replace(page, new),
                Programming::Status(status) => self.stored_status = status,
            }
            self.write_enabled = false;
        }
    }

    /// The supply fails now. A page being written is left torn; the part comes back write-disabled.
    pub fn power_cut(&mut self) {
        match self.programming.take() {
            Some((_, Programming::Page { page, mut new })) => {
                let old = self.memory.iter().skip(page * PAGE);
                for (new, old) in new.iter_mut().zip(old) {
                    match self.random.below(3) {
                        0 => *new = *old,
                        1 => {}
                        _ => *new = ERASED,
                    }
                }
                self.replace(page, new);
            }
            Some((_, Programming::Status(status))) if self.random.below(2) == 1 => {
                self.stored_status = status;
            }
            _ => {}
        }
        self.write_enabled = false;
        self.transfer = Transfer::Idle;
    }

    /// Fault injection: with `false` the part takes no commands and leaves its output floating, which
    /// reads as ones.
    pub fn set_answering(&mut self, answering: bool) {
        self.answering = answering;
    }

    /// Gives a page new bytes, unless the backing refuses them.
    fn replace(&mut self, page: usize, new: [u8; PAGE]) {
        let place = page * PAGE..(page + 1) * PAGE;
        let Some(cells) = self.memory.get_mut(place.clone()) else { return };
        let mut old = new;
        cells.swap_with_slice(&mut old);
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

    /// The first address that BP1/BP0 protect: nothing, upper quarter, upper half, all.
    fn first_protected(&self) -> usize {
        match (self.stored_status & STATUS_BP) >> 2 {
            0 => SIZE,
            1 => SIZE / 4 * 3,
            2 => SIZE / 2,
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

    fn start_page(&mut self, now: Nanos, at: usize, data: &[u8; PAGE], given: u64) {
        if given == 0 || !self.write_enabled || at >= self.first_protected() {
            return;
        }
        let page = at / PAGE;
        let old = self.memory.iter().skip(page * PAGE).copied();
        let mut new = *data;
        for (place, (byte, old)) in new.iter_mut().zip(old).enumerate() {
            if given >> place & 1 == 0 {
                *byte = old;
            }
        }
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
        self.transfer = match transfer {
            Transfer::Opcode => self.begin(mosi),
            Transfer::ReadStatus => {
                miso = self.status();
                Transfer::ReadStatus
            }
            Transfer::WriteStatus(_) => Transfer::WriteStatus(Some(mosi)),
            Transfer::Address { write, high: None } => Transfer::Address { write, high: Some(mosi) },
            Transfer::Address { write, high: Some(high) } => {
                let at = usize::from(u16::from_be_bytes([high, mosi])) & ADDRESS_MASK;
                if write { Transfer::Write { at, data: [ERASED; PAGE], given: 0 } } else { Transfer::Read { at } }
            }
            Transfer::Read { at } => {
                miso = self.memory.get(at).copied().unwrap_or(ERASED);
                Transfer::Read { at: (at + 1) & ADDRESS_MASK }
            }
            Transfer::Write { at, mut data, mut given } => {
                let place = at % PAGE;
                if let Some(byte) = data.get_mut(place) {
                    *byte = mosi;
                }
                given |= 1 << place;
                Transfer::Write { at: at - place + (place + 1) % PAGE, data, given }
            }
            // A byte too many: the chip select does not rise where the command ends.
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
mod tests {
    use super::*;
    use crate::clock::SECOND;

    fn transfer(part: &mut At25, now: Nanos, bytes: &[u8]) -> Vec<u8> {
        part.advance(now);
        part.select(now);
        let answer = bytes.iter().map(|&byte| part.byte(byte)).collect();
        part.deselect(now);
        answer
    }

    fn write(part: &mut At25, now: Nanos, address: u16, data: &[u8]) {
        transfer(part, now, &[WREN]);
        let mut bytes = vec![WRITE];
        bytes.extend(address.to_be_bytes());
        bytes.extend(data);
        transfer(part, now, &bytes);
    }

    #[test]
    fn a_fresh_part_is_erased_and_write_disabled() {
        let mut part = At25::new(1);
        assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0);
        assert_eq!(transfer(&mut part, 0, &[READ, 0, 0, 0, 0])[3..], [0xFF, 0xFF]);
        transfer(&mut part, 0, &[WRITE, 0, 0, 0x55]);
        assert!(!part.is_writing());
    }

    #[test]
    fn a_write_takes_five_milliseconds_and_answers_only_rdsr_meanwhile() {
        let mut part = At25::new(1);
        transfer(&mut part, 0, &[WREN]);
        assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0x02);
        transfer(&mut part, 0, &[WRITE, 0x01, 0x00, 0xAB]);
        assert_eq!(part.next_event(), Some(5_000_000));
        // Datasheet: bits 0-7 are 1s during an internal write cycle.
        assert_eq!(transfer(&mut part, 4_999_999, &[RDSR, 0, 0])[1..], [0xFF; 2]);
        assert_eq!(transfer(&mut part, 4_999_999, &[READ, 1, 0, 0])[3], 0xFF, "not answered");
        assert_eq!(transfer(&mut part, 5_000_000, &[RDSR, 0])[1], 0x00);
        assert_eq!(transfer(&mut part, 5_000_000, &[READ, 1, 0, 0])[3], 0xAB);
        assert_eq!(part.page_writes(4), 1);
        assert_eq!(part.most_page_writes(), 1);
    }

    #[test]
    fn a_long_write_wraps_within_its_page() {
        let mut part = At25::new(1);
        // Starts at byte 62 of page 1: 62, 63, then 0 and 1 of the same page.
        write(&mut part, 0, 64 + 62, &[1, 2, 3, 4]);
        part.advance(WRITE_CYCLE);
        assert_eq!(part.contents()[64 + 62..64 + 64], [1, 2]);
        assert_eq!(part.contents()[64..67], [3, 4, 0xFF]);
        assert_eq!(part.contents()[128], 0xFF);
    }

    #[test]
    fn reading_rolls_over_at_the_end_and_ignores_the_upper_address_bits() {
        let mut part = At25::new(1);
        let mut image = vec![0u8; SIZE];
        image[0] = 0x11;
        image[SIZE - 1] = 0x22;
        part.load(&image);
        assert_eq!(transfer(&mut part, 0, &[READ, 0xFF, 0xFF, 0, 0])[3..], [0x22, 0x11]);
    }

    #[test]
    fn no_write_without_data_and_the_latch_survives_it() {
        let mut part = At25::new(1);
        transfer(&mut part, 0, &[WREN]);
        transfer(&mut part, 0, &[WRITE, 0, 0]);
        assert!(!part.is_writing());
        assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0x02);
        transfer(&mut part, 0, &[WRDI]);
        assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0x00);
    }

    #[test]
    fn the_block_bits_protect_the_upper_quarter() {
        let mut part = At25::new(1);
        transfer(&mut part, 0, &[WREN]);
        transfer(&mut part, 0, &[WRSR, 0x04]);
        let now = WRITE_CYCLE;
        assert_eq!(transfer(&mut part, now, &[RDSR, 0])[1], 0x04);
        write(&mut part, now, 0x3000, &[1]);
        assert!(!part.is_writing(), "0x3000 is the first protected address");
        write(&mut part, now, 0x2FFF, &[1]);
        assert!(part.is_writing());
    }

    #[test]
    fn a_power_cut_tears_the_page_reproducibly_and_spares_the_others() {
        let torn = |seed| {
            let mut part = At25::new(seed);
            part.load(&[0x00; 192]);
            write(&mut part, 0, 64, &[0x77; PAGE]);
            part.advance(MILLISECOND);
            part.power_cut();
            part.advance(WRITE_CYCLE);
            assert!(part.contents()[..64].iter().all(|&b| b == 0));
            assert!(part.contents()[128..192].iter().all(|&b| b == 0));
            part.contents()[64..128].to_vec()
        };
        let page = torn(3);
        for kind in [0x00, 0x77, 0xFF] {
            assert!(page.contains(&kind));
        }
        assert_eq!(page, torn(3));
        assert_ne!(page, torn(4));
    }

    /// Takes the contents while page 1 begins with an even byte, and passes on what it is shown.
    #[derive(Debug)]
    struct Choosy(std::sync::mpsc::Sender<Vec<u8>>);

    impl Backing for Choosy {
        fn keep(&mut self, contents: &[u8]) -> bool {
            self.0.send(contents.to_vec()).unwrap();
            contents[PAGE].is_multiple_of(2)
        }
    }

    #[test]
    fn a_page_that_cannot_be_kept_keeps_its_old_bytes() {
        let (sender, kept) = std::sync::mpsc::channel();
        let mut part = At25::new(1);
        part.keep_in(Box::new(Choosy(sender)));
        for (number, first, held) in [(1, 0x10, 0x10), (2, 0x11, 0x10), (3, 0x12, 0x12)] {
            write(&mut part, number * SECOND, PAGE as u16, &[first; PAGE]);
            part.advance(number * SECOND + WRITE_CYCLE - 1);
            assert!(kept.try_recv().is_err(), "asked when the write cycle ends, not before");
            part.advance(number * SECOND + WRITE_CYCLE);
            assert_eq!(kept.try_recv().unwrap()[PAGE..2 * PAGE], [first; PAGE]);
            assert_eq!(part.contents()[PAGE..2 * PAGE], [held; PAGE]);
            assert!(!part.is_writing(), "the write cycle is over either way");
        }
        // A page that a power cut has torn is kept as it is.
        write(&mut part, 4 * SECOND, 2 * PAGE as u16, &[0x77; PAGE]);
        part.power_cut();
        assert_eq!(kept.try_recv().unwrap(), part.contents());
        assert_ne!(part.contents()[2 * PAGE..3 * PAGE], [ERASED; PAGE]);
    }

    #[test]
    fn a_part_that_does_not_answer_reads_as_ones_and_keeps_its_contents() {
        let mut part = At25::new(1);
        part.load(&[0x12]);
        part.set_answering(false);
        assert_eq!(transfer(&mut part, 0, &[READ, 0, 0, 0]), [0xFF; 4]);
        write(&mut part, 0, 0, &[0x99]);
        assert!(!part.is_writing());
        part.set_answering(true);
        assert_eq!(transfer(&mut part, 0, &[READ, 0, 0, 0])[3], 0x12);
    }
}
