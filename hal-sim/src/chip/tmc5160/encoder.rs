//! The ABN encoder interface (20, 6.4): a counter with a factor, and what the null track does to it.

use super::registers::{
    Registers,
    address::{ENC_CONST, ENC_DEVIATION, ENCMODE},
};
use crate::chip::Tracks;

/// Bits of ENCMODE (6.4.1).
mod mode {
    pub(super) const POL_A: u32 = 0;
    pub(super) const POL_B: u32 = 1;
    pub(super) const POL_N: u32 = 2;
    pub(super) const IGNORE_AB: u32 = 3;
    pub(super) const CLR_CONT: u32 = 4;
    pub(super) const CLR_ONCE: u32 = 5;
    pub(super) const POS_EDGE: u32 = 6;
    pub(super) const NEG_EDGE: u32 = 7;
    pub(super) const CLR_ENC_X: u32 = 8;
    pub(super) const LATCH_X_ACT: u32 = 9;
    pub(super) const DECIMAL: u32 = 10;
}

/// The encoder counter.
#[derive(Debug, Default)]
pub(super) struct Encoder {
    /// The quadrature counts of the encoder itself, which no register shows.
    count: i64,
    tracks: Tracks,
    /// X_ENC.
    position: i32,
    /// The part behind the point of X_ENC, in 1/65536 or, in decimal mode, 1/10000.
    fraction: i32,
    latch: i32,
    /// n_event.
    null_event: bool,
    /// deviation_warn.
    warning: bool,
}

/// An N event, with what it asks for beside the latching of X_ENC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NullEvent {
    /// XACTUAL is to be latched, too.
    pub(super) latch_position: bool,
}

impl Encoder {
    /// Forgets everything but the encoder's own position.
    pub(super) fn reset(&mut self) {
        *self = Self { count: self.count, tracks: self.tracks, ..Self::default() };
    }

    /// The counts of the encoder that have been seen.
    #[inline]
    pub(super) fn count(&self) -> i64 {
        self.count
    }

    /// The levels at the pins.
    pub(super) fn tracks(&self) -> Tracks {
        self.tracks
    }

    /// Takes the encoder as standing at `count`, as it does when the chip is connected to it.
    pub(super) fn plug(&mut self, count: i64, tracks: Tracks) {
        (self.count, self.tracks) = (count, tracks);
    }

    /// X_ENC.
    pub(super) fn position(&self) -> i32 {
        self.position
    }

    /// Writes X_ENC.
    pub(super) fn set_position(&mut self, position: i32) {
        (self.position, self.fraction) = (position, 0);
    }

    /// ENC_LATCH.
    pub(super) fn latch(&self) -> i32 {
        self.latch
    }

    /// Latches X_ENC.
    pub(super) fn take_latch(&mut self) {
        self.latch = self.position;
    }

    /// The flags n_event and deviation_warn.
    pub(super) fn flags(&self) -> [bool; 2] {
        [self.null_event, self.warning]
    }

    /// Clears n_event, deviation_warn. The warning comes back where it persists.
    pub(super) fn clear(&mut self, [null_event, warning]: [bool; 2]) {
        self.null_event &= !null_event;
        self.warning &= !warning;
    }

    /// Warns if X_ENC is too far from `position`.
    #[inline]
    pub(super) fn compare(&mut self, position: i32, registers: &Registers) {
        let most = registers.get(ENC_DEVIATION);
        self.warning |= most != 0 && self.position.wrapping_sub(position).unsigned_abs() > most;
    }

    /// Counts a polarity change of A or B, after which the pins have these levels.
    pub(super) fn edge(&mut self, up: bool, tracks: Tracks, registers: &mut Registers) -> Option<NullEvent> {
        self.count += if up { 1 } else { -1 };
        let base = if registers.bit(ENCMODE, mode::DECIMAL) { 10_000 } else { 1 << 16 };
        let factor = registers.get(ENC_CONST);
        let whole = factor.cast_signed() >> 16;
        let decimals = (factor & 0xFFFF).cast_signed();
        if up {
            self.position = self.position.wrapping_add(whole);
            self.fraction += decimals;
        } else {
            self.position = self.position.wrapping_sub(whole);
            self.fraction -= decimals;
        }
        self.position = self.position.wrapping_add(self.fraction.div_euclid(base));
        self.fraction = self.fraction.rem_euclid(base);
        let before = std::mem::replace(&mut self.tracks, tracks);
        self.heed_null(before, registers)
    }

    /// The mode has changed: a level that is active now is an event at once.
    pub(super) fn mode_written(&mut self, registers: &mut Registers) -> Option<NullEvent> {
        self.heed_null(self.tracks, registers)
    }

    /// Whether the null track counts as active: with its own polarity, and, unless they are ignored, with those of A
    /// and B (20, "N signal").
    fn active(tracks: Tracks, registers: &Registers) -> bool {
        let is = |level: bool, bit| level == registers.bit(ENCMODE, bit);
        is(tracks.n, mode::POL_N)
            && (registers.bit(ENCMODE, mode::IGNORE_AB) || is(tracks.a, mode::POL_A) && is(tracks.b, mode::POL_B))
    }

    fn heed_null(&mut self, before: Tracks, registers: &mut Registers) -> Option<NullEvent> {
        let bit = |bit| registers.bit(ENCMODE, bit);
        if !bit(mode::CLR_CONT) && !bit(mode::CLR_ONCE) {
            return None;
        }
        let (before, now) = (Self::active(before, registers), Self::active(self.tracks, registers));
        let event = match (bit(mode::NEG_EDGE), bit(mode::POS_EDGE)) {
            (false, false) => now,
            (false, true) => now && !before,
            (true, false) => before && !now,
            (true, true) => before != now,
        };
        if !event {
            return None;
        }
        let latch_position = bit(mode::LATCH_X_ACT);
        let clears = bit(mode::CLR_ENC_X);
        self.null_event = true;
        self.take_latch();
        if clears {
            self.set_position(0);
        }
        registers.write(ENCMODE, registers.get(ENCMODE) & !(1 << mode::CLR_ONCE));
        Some(NullEvent { latch_position })
    }
}
