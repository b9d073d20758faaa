//! The acceptance filters (RM0090 32.7.4): 28 banks of one or two filters, masks or lists.

use crate::mcu::peripheral::{Access, Refusal, bit};

const FMR: u32 = 0x00;
const FM1R: u32 = 0x04;
const FS1R: u32 = 0x0C;
const FFA1R: u32 = 0x14;
const FA1R: u32 = 0x1C;
const BANKS: core::ops::Range<u32> = 0x40..0x120;

const COUNT: usize = 28;
const FMR_RESET: u32 = 0x2A1C_0E01;

/// The filters. CAN1 has the banks up to the one that FMR names.
#[derive(Debug)]
pub(super) struct Filters {
    fmr: u32,
    /// Lists instead of masks.
    fm1r: u32,
    /// Filters of 32 bits instead of 16.
    fs1r: u32,
    /// FIFO 1 instead of 0.
    ffa1r: u32,
    /// Active.
    fa1r: u32,
    banks: [[u32; 2]; COUNT],
}

impl Filters {
    pub(super) fn new() -> Self {
        Self { fmr: FMR_RESET, fm1r: 0, fs1r: 0, ffa1r: 0, fa1r: 0, banks: [[0; 2]; COUNT] }
    }

    /// The FIFO that takes a frame with this identifier register, and the number of the filter that let it through.
    pub(super) fn matches(&self, identifier: u32) -> Option<(usize, u32)> {
        if bit(self.fmr, 0) {
            return None;
        }
        let short = shorten(identifier);
        let mut numbers = [0; 2];
        // Wide filters go before narrow ones, lists before masks; then the lower number.
        let mut best: Option<((bool, bool, u32), usize)> = None;
        let own = (self.fmr >> 8 & 0x3F) as usize;
        for (index, &[first, second]) in self.banks.iter().enumerate().take(own) {
            let at = index as u32;
            let (list, wide, fifo) = (bit(self.fm1r, at), bit(self.fs1r, at), usize::from(bit(self.ffa1r, at)));
            let halves = [first, second].map(|word| [word & 0xFFFF, word >> 16]);
            let [[a, b], [c, d]] = halves;
            let hits: [Option<bool>; 4] = match (wide, list) {
                // Bit 0 is no part of an identifier.
                (true, false) => [Some((identifier ^ first) & second & !1 == 0), None, None, None],
                (true, true) => [Some(identifier & !1 == first & !1), Some(identifier & !1 == second & !1), None, None],
                (false, false) => [Some((short ^ a) & b == 0), Some((short ^ c) & d == 0), None, None],
                (false, true) => [a, b, c, d].map(|entry| Some(short == entry)),
            };
            for hit in hits.into_iter().flatten() {
                let rank = (!wide, !list, numbers[fifo]);
                numbers[fifo] += 1;
                if hit && bit(self.fa1r, at) && best.is_none_or(|(other, _)| rank < other) {
                    best = Some((rank, fifo));
                }
            }
        }
        best.map(|((.., number), fifo)| (fifo, number))
    }

    pub(super) fn read(&self, offset: u32) -> Access<u32> {
        match offset {
            FMR => Ok(self.fmr),
            FM1R => Ok(self.fm1r),
            FS1R => Ok(self.fs1r),
            FFA1R => Ok(self.ffa1r),
            FA1R => Ok(self.fa1r),
            _ if BANKS.contains(&offset) => {
                let place = (offset - BANKS.start) as usize;
                Ok(self.banks[place / 8][place % 8 / 4])
            }
            _ => Err(Refusal::Register),
        }
    }

    pub(super) fn write(&mut self, offset: u32, value: u32) -> Access {
        let initialising = bit(self.fmr, 0);
        match offset {
            FMR => self.fmr = FMR_RESET & !0x3F01 | value & 0x3F01,
            FM1R | FS1R | FFA1R if !initialising => {
                return Err(Refusal::Use("filters are set up while they are active"));
            }
            FM1R => self.fm1r = value,
            FS1R => self.fs1r = value,
            FFA1R => self.ffa1r = value,
            FA1R => self.fa1r = value,
            _ if BANKS.contains(&offset) => {
                let place = (offset - BANKS.start) as usize;
                if !initialising && bit(self.fa1r, (place / 8) as u32) {
                    return Err(Refusal::Use("a filter is changed while it is active"));
                }
                self.banks[place / 8][place % 8 / 4] = value;
            }
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }
}

/// The identifier in the order of a filter of 16 bits: STID, RTR, IDE, the three highest of EXID.
fn shorten(identifier: u32) -> u32 {
    identifier >> 21 << 5 | (identifier >> 1 & 1) << 4 | (identifier >> 2 & 1) << 3 | identifier >> 18 & 7
}
