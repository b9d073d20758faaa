//! Instructions that work on registers.

use rsemu::cpu::arm::v7m::isa::{BitfieldOp, DpOp, ExtendOp, Insn, MiscOp, Operand, Shift, ShiftType};
use rsemu::cpu::arm::v7m::sys::ccr;
use rsemu::cpu::arm::v7m::xpsr;

use super::core::Core;
use super::registers::PC;
use super::trap::{Outcome, Trap};

impl Core {
    /// Adds, subtracts, moves, compares, or works bit by bit.
    #[inline]
    pub(super) fn process(&mut self, op: DpOp, s: bool, rd: u8, rn: u8, operand: Operand) {
        let registers = &mut self.registers;
        let carry = registers.has(xpsr::C);
        let (b, shifted) = match operand {
            Operand::Imm { value, carry: made } => (value, made.unwrap_or(carry)),
            Operand::Reg { rm, shift } if shift.is_none() => (registers.get(rm), carry),
            Operand::Reg { rm, shift } => shift_by_constant(shift, registers.get(rm), carry),
        };
        let a = registers.get(rn);
        // A sum's carry and overflow; what is worked on bit by bit has the shifter's carry.
        let bits = |result| (result, None);
        let (result, sum) = match op {
            DpOp::Mov => bits(b),
            DpOp::Mvn => bits(!b),
            DpOp::And | DpOp::Tst => bits(a & b),
            DpOp::Bic => bits(a & !b),
            DpOp::Orr => bits(a | b),
            DpOp::Orn => bits(a | !b),
            DpOp::Eor | DpOp::Teq => bits(a ^ b),
            DpOp::Add | DpOp::Cmn => add(a, b, false),
            DpOp::Adc => add(a, b, carry),
            DpOp::Sub | DpOp::Cmp => add(a, !b, true),
            DpOp::Sbc => add(a, !b, carry),
            DpOp::Rsb => add(!a, b, true),
        };
        if s {
            match sum {
                Some((carry, overflow)) => registers.set_nzcv(result, carry, overflow),
                None => {
                    registers.set_nz(result);
                    registers.put(xpsr::C, u32::from(shifted) << 29);
                }
            }
        }
        if op.is_test() {
            return;
        }
        if rd == PC {
            self.branch(result);
        } else {
            self.registers.set(rd, result);
        }
    }

    /// Shifts by a register.
    pub(super) fn shift(&mut self, ty: ShiftType, s: bool, rd: u8, rn: u8, rm: u8) {
        let registers = &mut self.registers;
        let amount = registers.get(rm) & 0xFF;
        let (result, carry) = shift_by(ty, registers.get(rn), amount, registers.has(xpsr::C));
        registers.set(rd, result);
        if s {
            registers.set_nz(result);
            registers.put(xpsr::C, u32::from(carry) << 29);
        }
    }

    /// Takes a field of bits out of a register, or puts one in.
    pub(super) fn move_field(&mut self, op: BitfieldOp, rd: u8, rn: u8, lsb: u8, width: u8) {
        let (lsb, width) = (u32::from(lsb & 31), u32::from(width).clamp(1, 32));
        let ones = u32::MAX >> (32 - width);
        let (from, old) = (self.registers.get(rn), self.registers.get(rd));
        let spared = old & !(ones << lsb);
        let result = match op {
            BitfieldOp::Ubfx => from >> lsb & ones,
            BitfieldOp::Sbfx => ((from >> lsb << (32 - width)) as i32 >> (32 - width)) as u32,
            BitfieldOp::Bfi => spared | (from & ones) << lsb,
            BitfieldOp::Bfc => spared,
        };
        self.registers.set(rd, result);
    }

    /// Makes words of bytes or half words, and adds them to `rn` unless that is the PC.
    pub(super) fn extend(&mut self, op: ExtendOp, rd: u8, rn: u8, rm: u8, rotate: u8) {
        let from = self.registers.get(rm).rotate_right(rotate.into());
        let signed = |byte: u32| i32::from(byte as u8 as i8) as u32;
        let result = match op {
            ExtendOp::Sxtb => signed(from),
            ExtendOp::Sxth => i32::from(from as u16 as i16) as u32,
            ExtendOp::Uxtb => from & 0xFF,
            ExtendOp::Uxth => from & 0xFFFF,
            ExtendOp::Sxtb16 => signed(from) & 0xFFFF | signed(from >> 16) << 16,
            ExtendOp::Uxtb16 => from & 0x00FF_00FF,
        };
        let result = match (op, self.registers.get(rn)) {
            _ if rn == PC => result,
            (ExtendOp::Sxtb16 | ExtendOp::Uxtb16, to) => {
                let low = to.wrapping_add(result) & 0xFFFF;
                low | (to >> 16).wrapping_add(result >> 16) << 16
            }
            (_, to) => to.wrapping_add(result),
        };
        self.registers.set(rd, result);
    }

    /// Multiplies, and adds to or subtracts from `ra`.
    pub(super) fn multiply(&mut self, rd: u8, rn: u8, rm: u8, ra: Option<u8>, subtract: bool, s: bool) {
        let product = self.registers.get(rn).wrapping_mul(self.registers.get(rm));
        let result = match ra.map(|ra| self.registers.get(ra)) {
            None => product,
            Some(to) if subtract => to.wrapping_sub(product),
            Some(to) => to.wrapping_add(product),
        };
        self.registers.set(rd, result);
        if s {
            self.registers.set_nz(result);
        }
    }

    /// Multiplies to 64 bits.
    pub(super) fn multiply_long(&mut self, insn: &Insn) {
        let Insn::MulLong { signed, accumulate, rdlo, rdhi, rn, rm, umaal } = *insn else { return };
        let registers = &mut self.registers;
        let [a, b, low, high] = [rn, rm, rdlo, rdhi].map(|register| registers.get(register));
        let product =
            if signed { (i64::from(a as i32) * i64::from(b as i32)) as u64 } else { u64::from(a) * u64::from(b) };
        let result = if umaal {
            product + u64::from(low) + u64::from(high)
        } else if accumulate {
            product.wrapping_add(u64::from(high) << 32 | u64::from(low))
        } else {
            product
        };
        registers.set(rdlo, result as u32);
        registers.set(rdhi, (result >> 32) as u32);
        self.used += 1;
    }

    /// Divides; by zero that gives zero, unless the program wants to know.
    pub(super) fn divide(&mut self, signed: bool, rd: u8, rn: u8, rm: u8) -> Outcome {
        let (a, b) = (self.registers.get(rn), self.registers.get(rm));
        self.used += 2;
        let result = match b {
            0 if self.sys.ccr & ccr::DIV_0_TRP != 0 => return Err(Trap::Zero),
            0 => 0,
            _ if signed => (a as i32).wrapping_div(b as i32) as u32,
            _ => a / b,
        };
        self.registers.set(rd, result);
        Ok(())
    }

    /// Counts leading zeros, or reverses bits or bytes.
    pub(super) fn rearrange(&mut self, op: MiscOp, rd: u8, rm: u8) {
        let from = self.registers.get(rm);
        let result = match op {
            MiscOp::Clz => from.leading_zeros(),
            MiscOp::Rbit => from.reverse_bits(),
            MiscOp::Rev => from.swap_bytes(),
            MiscOp::Rev16 => from.swap_bytes().rotate_left(16),
            MiscOp::Revsh => i32::from((from as u16).swap_bytes() as i16) as u32,
        };
        self.registers.set(rd, result);
    }
}

/// A sum with its carry and overflow.
#[inline]
fn add(a: u32, b: u32, carry: bool) -> (u32, Option<(bool, bool)>) {
    let (sum, over) = a.overflowing_add(b);
    let (sum, more) = sum.overflowing_add(carry.into());
    (sum, Some((over | more, (a ^ sum) & (b ^ sum) & xpsr::N != 0)))
}

/// A shift whose amount the instruction has, with the carry that it leaves.
#[inline]
pub(super) fn shift_by_constant(shift: Shift, value: u32, carry: bool) -> (u32, bool) {
    match shift.ty {
        ShiftType::Rrx => (u32::from(carry) << 31 | value >> 1, value & 1 != 0),
        ty => shift_by(ty, value, shift.amount.into(), carry),
    }
}

/// A shift by up to 255, with the carry that it leaves.
#[inline]
fn shift_by(ty: ShiftType, value: u32, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    // In 64 bits, with the carry next to the result.
    let wide = u64::from(value);
    match ty {
        ShiftType::Lsl => {
            let shifted = wide.checked_shl(amount).unwrap_or(0);
            (shifted as u32, shifted >> 32 & 1 != 0)
        }
        ShiftType::Lsr => {
            let shifted = (wide << 1).checked_shr(amount).unwrap_or(0);
            ((shifted >> 1) as u32, shifted & 1 != 0)
        }
        ShiftType::Asr => {
            let shifted = (i64::from(value as i32) << 1) >> amount.min(32);
            ((shifted >> 1) as u32, shifted & 1 != 0)
        }
        ShiftType::Ror | ShiftType::Rrx => {
            let rotated = value.rotate_right(amount & 31);
            (rotated, rotated >> 31 != 0)
        }
    }
}
