//! Instructions of the DSP extension: halves, lanes, saturation.

use rsemu::cpu::arm::v7m::isa::{DualMulOp, HalfMulOp, Insn, SatQOp, Shift, SimdMode, SimdShape};
use rsemu::cpu::arm::v7m::xpsr;

use super::core::Core;
use super::data::shift_by_constant;
use super::registers::PC;

impl Core {
    /// Multiplies half words, or a word by a half word.
    pub(super) fn multiply_halves(&mut self, insn: &Insn) {
        let Insn::HalfMul { op, rd, rn, rm, ra, x, y } = *insn else { return };
        self.used += 1;
        let [n, m, a] = [rn, rm, ra].map(|register| self.registers.get(register));
        let halves = half(n, x) * half(m, y);
        let word = (i64::from(n as i32) * half(m, y)) >> 16;
        let accumulated = match op {
            HalfMulOp::Smul => return self.registers.set(rd, halves as u32),
            HalfMulOp::Smulw => return self.registers.set(rd, word as u32),
            HalfMulOp::Smla => halves + i64::from(a as i32),
            HalfMulOp::Smlaw => word + i64::from(a as i32),
            HalfMulOp::Smlal => return self.add_long(ra, rd, halves),
        };
        self.overflow(accumulated != i64::from(accumulated as i32));
        self.registers.set(rd, accumulated as u32);
    }

    /// Multiplies two half words at a time, or takes the upper half of a product.
    pub(super) fn multiply_dual(&mut self, insn: &Insn) {
        let Insn::DualMul { op, rd, rn, rm, ra, x } = *insn else { return };
        self.used += 1;
        let [n, m, a] = [rn, rm, ra].map(|register| self.registers.get(register));
        let (first, second) = (half(n, false) * half(m, x), half(n, true) * half(m, !x));
        let whole = i64::from(n as i32) * i64::from(m as i32);
        let (upper, rounding) = (i64::from(a as i32) << 32, i64::from(x) << 31);
        let a = i64::from(a as i32);
        let result = match op {
            DualMulOp::Smuad => first + second,
            DualMulOp::Smusd => first - second,
            DualMulOp::Smlad => first + second + a,
            DualMulOp::Smlsd => first - second + a,
            DualMulOp::Smlald => return self.add_long(ra, rd, first + second),
            DualMulOp::Smlsld => return self.add_long(ra, rd, first - second),
            DualMulOp::Smmul | DualMulOp::Smmla | DualMulOp::Smmls => {
                let sum = match op {
                    DualMulOp::Smmul => whole,
                    DualMulOp::Smmla => upper.wrapping_add(whole),
                    _ => upper.wrapping_sub(whole),
                };
                return self.registers.set(rd, (sum.wrapping_add(rounding) >> 32) as u32);
            }
        };
        self.overflow(result != i64::from(result as i32));
        self.registers.set(rd, result as u32);
    }

    /// Adds to a number in two registers.
    fn add_long(&mut self, low: u8, high: u8, number: i64) {
        let before = u64::from(self.registers.get(high)) << 32 | u64::from(self.registers.get(low));
        let after = before.wrapping_add(number as u64);
        self.registers.set(low, after as u32);
        self.registers.set(high, (after >> 32) as u32);
    }

    /// Limits a word or two half words to fewer bits.
    pub(super) fn saturate(&mut self, insn: &Insn) {
        let Insn::Sat { unsigned, halves, rd, rn, imm, shift } = *insn else { return };
        let from = self.registers.get(rn);
        let range = if unsigned { 0..=(1_i64 << imm) - 1 } else { -(1_i64 << (imm - 1))..=(1_i64 << (imm - 1)) - 1 };
        let mut limit = |number: i64| {
            let limited = number.clamp(*range.start(), *range.end());
            self.overflow(limited != number);
            limited as u32
        };
        let result = if halves {
            limit(half(from, false)) & 0xFFFF | limit(half(from, true)) << 16
        } else {
            let (shifted, _) = shift_by_constant(shift, from, false);
            limit(i64::from(shifted as i32))
        };
        self.registers.set(rd, result);
    }

    /// Adds or subtracts words and limits the sum.
    pub(super) fn add_saturating(&mut self, op: SatQOp, rd: u8, rn: u8, rm: u8) {
        let [n, m] = [rn, rm].map(|register| i64::from(self.registers.get(register) as i32));
        let result = match op {
            SatQOp::Qadd => self.limited(m + n),
            SatQOp::Qsub => self.limited(m - n),
            SatQOp::Qdadd => {
                let twice = self.limited(2 * n);
                self.limited(m + twice)
            }
            SatQOp::Qdsub => {
                let twice = self.limited(2 * n);
                self.limited(m - twice)
            }
        };
        self.registers.set(rd, result as u32);
    }

    /// A number limited to a signed word.
    fn limited(&mut self, number: i64) -> i64 {
        let limited = number.clamp(i32::MIN.into(), i32::MAX.into());
        self.overflow(limited != number);
        limited
    }

    /// Sets the flag Q if something did not fit.
    fn overflow(&mut self, over: bool) {
        if over {
            self.registers.put(xpsr::Q, xpsr::Q);
        }
    }

    /// Adds or subtracts bytes or half words side by side.
    pub(super) fn add_lanes(&mut self, mode: SimdMode, shape: SimdShape, rd: u8, rn: u8, rm: u8) {
        let (a, b) = (self.registers.get(rn), self.registers.get(rm));
        // Bits of a lane; which lanes are subtracted; whether those of the second operand change places.
        let (bits, subtracted, crossed) = match shape {
            SimdShape::Add8 => (8, 0b0000, false),
            SimdShape::Sub8 => (8, 0b1111, false),
            SimdShape::Add16 => (16, 0b00, false),
            SimdShape::Sub16 => (16, 0b11, false),
            SimdShape::Asx => (16, 0b01, true),
            SimdShape::Sax => (16, 0b10, true),
        };
        let b = if crossed { b.rotate_left(16) } else { b };
        let (mut result, mut flags) = (0, 0);
        for lane in 0..32 / bits {
            let [x, y] = [a, b].map(|word| {
                let up = word >> (bits * lane) << (32 - bits);
                if mode.is_unsigned() { i64::from(up >> (32 - bits)) } else { i64::from(up as i32 >> (32 - bits)) }
            });
            let minus = subtracted >> lane & 1 != 0;
            let sum = if minus { x - y } else { x + y };
            let limited = match mode {
                SimdMode::Signed | SimdMode::Unsigned => sum,
                SimdMode::SignedSat => sum.clamp(-1 << (bits - 1), (1 << (bits - 1)) - 1),
                SimdMode::UnsignedSat => sum.clamp(0, (1 << bits) - 1),
                SimdMode::SignedHalve | SimdMode::UnsignedHalve => sum >> 1,
            };
            result |= (limited as u32) << (32 - bits) >> (32 - bits) << (bits * lane);
            let least = if mode.is_unsigned() && !minus { 1 << bits } else { 0 };
            if sum >= least {
                // The four flags belong to the bytes.
                flags |= (u32::MAX >> (32 - bits / 8)) << (bits / 8 * lane);
            }
        }
        self.registers.set(rd, result);
        if mode.sets_ge() {
            self.registers.put(xpsr::GE, flags << 16);
        }
    }

    /// Takes each byte from one of two registers, by the flags GE.
    pub(super) fn select(&mut self, rd: u8, rn: u8, rm: u8) {
        let flags = self.registers.xpsr() >> 16 & 0xF;
        let taken = (0..4).filter(|byte| flags >> byte & 1 != 0).fold(0, |mask, byte| mask | 0xFF << (8 * byte));
        self.registers.set(rd, self.registers.get(rn) & taken | self.registers.get(rm) & !taken);
    }

    /// Sums up how far the bytes of two registers are apart.
    pub(super) fn sum_differences(&mut self, rd: u8, rn: u8, rm: u8, ra: u8) {
        let [a, b] = [rn, rm].map(|register| self.registers.get(register).to_le_bytes());
        let apart: u32 = a.into_iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
        let to = if ra == PC { 0 } else { self.registers.get(ra) };
        self.registers.set(rd, to.wrapping_add(apart));
    }

    /// Makes a word of two halves.
    pub(super) fn pack(&mut self, tb: bool, rd: u8, rn: u8, rm: u8, shift: Shift) {
        let from_second = if tb { 0x0000_FFFF } else { 0xFFFF_0000 };
        let (second, _) = shift_by_constant(shift, self.registers.get(rm), self.registers.has(xpsr::C));
        self.registers.set(rd, self.registers.get(rn) & !from_second | second & from_second);
    }
}

/// The lower or the upper half of a word.
fn half(word: u32, upper: bool) -> i64 {
    i64::from(if upper { (word >> 16) as i16 } else { word as i16 })
}
