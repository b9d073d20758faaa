//! Instructions: fetched, decoded, and executed each by the file of its kind.
//!
//! Cycles are counted as in the tables of the Cortex-M4's manual for code without wait states. They are one for each
//! instruction and each access, two more for a branch that is taken, one more for a product of 64 bits, two for a
//! division.

use rsemu::cpu::arm::v7m::isa::Insn;

use super::bus::Bus;
use super::code::Decoded;
use super::core::Core;
use super::registers::{LR, PC};
use super::trap::{Outcome, Trap};

/// Cycles that filling the pipeline takes after a branch.
const REFILL: u64 = 2;

impl Core {
    /// Executes an instruction, which is at the PC; on a fault, the PC is there still.
    #[inline]
    pub(super) fn perform<B: Bus>(&mut self, bus: &mut B, decoded: &Decoded) -> Outcome {
        let pc = self.registers.get(PC);
        self.next = pc.wrapping_add(decoded.bytes);
        self.registers.set(PC, pc.wrapping_add(4));
        let outcome =
            if self.registers.it == 0 { self.execute(bus, &decoded.insn) } else { self.execute_in_block(bus, decoded) };
        self.registers.set(PC, if outcome.is_ok() { self.next } else { pc });
        outcome
    }

    /// Executes an instruction of an IT block, if its condition holds.
    fn execute_in_block<B: Bus>(&mut self, bus: &mut B, decoded: &Decoded) -> Outcome {
        let before = self.registers.it;
        let holds = self.registers.holds_in_block();
        self.registers.advance_block();
        if !holds {
            return Ok(());
        }
        // Short instructions set the flags outside a block only (DDI 0403 A7.7.76).
        let outcome = if decoded.bytes == 2 {
            self.execute(bus, &without_flags(decoded.insn))
        } else {
            self.execute(bus, &decoded.insn)
        };
        if outcome.is_err() {
            self.registers.it = before;
        }
        outcome
    }

    #[inline]
    fn execute<B: Bus>(&mut self, bus: &mut B, insn: &Insn) -> Outcome {
        match *insn {
            Insn::DataProc { op, s, rd, rn, operand } => self.process(op, s, rd, rn, operand),
            Insn::LoadStore { load: true, .. } => return self.load(bus, insn),
            Insn::LoadStore { .. } => return self.store(bus, insn),
            Insn::Branch { cond, offset } => {
                if cond.is_none_or(|condition| self.registers.holds(condition)) {
                    self.branch(self.registers.get(PC).wrapping_add(offset as u32));
                }
            }
            Insn::LoadStoreMultiple { load, rn, list, wback, before } => {
                return self.transfer_many(bus, load, rn, list, wback, before);
            }
            Insn::Cbz { nonzero, rn, offset } => {
                if (self.registers.get(rn) != 0) == nonzero {
                    self.branch(self.registers.get(PC).wrapping_add(offset));
                }
            }
            Insn::BranchLink { offset } => {
                let pc = self.registers.get(PC);
                self.registers.set(LR, pc | 1);
                self.branch(pc.wrapping_add(offset as u32));
            }
            Insn::It { cond, mask } => self.registers.it = cond.0 << 4 | mask,
            Insn::LoadLiteral { size, signed, rt, imm, add } => {
                return self.load_literal(bus, size, signed, rt, imm, add);
            }
            Insn::LoadStoreDual { load: true, .. } => return self.load_pair(bus, insn),
            Insn::LoadStoreDual { .. } => return self.store_pair(bus, insn),
            Insn::Bx { rm } => return self.branch_exchange(bus, self.registers.get(rm)),
            Insn::Blx { rm } => {
                let target = self.registers.get(rm);
                self.registers.set(LR, self.registers.get(PC).wrapping_sub(2) | 1);
                return self.branch_exchange(bus, target);
            }
            Insn::TableBranch { rn, rm, half } => return self.branch_by_table(bus, rn, rm, half),
            Insn::ShiftReg { ty, s, rd, rn, rm } => self.shift(ty, s, rd, rn, rm),
            Insn::Adr { rd, imm, add } => self.registers.set(rd, self.beside_pc(imm, add)),
            Insn::MovImm16 { top, rd, imm } => {
                let imm = u32::from(imm);
                let value = if top { self.registers.get(rd) & 0xFFFF | imm << 16 } else { imm };
                self.registers.set(rd, value);
            }
            Insn::Bitfield { op, rd, rn, lsb, width } => self.move_field(op, rd, rn, lsb, width),
            Insn::Extend { op, rd, rn, rm, rotate } => self.extend(op, rd, rn, rm, rotate),
            Insn::Mul { rd, rn, rm, ra, sub, s } => self.multiply(rd, rn, rm, ra, sub, s),
            Insn::MulLong { .. } => self.multiply_long(insn),
            Insn::Div { signed, rd, rn, rm } => return self.divide(signed, rd, rn, rm),
            Insn::Misc { op, rd, rm } => self.rearrange(op, rd, rm),
            Insn::LoadStoreExclusive { load, size, rd, rt, rn, imm } => {
                let address = self.registers.get(rn).wrapping_add(imm);
                return if load {
                    self.load_exclusive(bus, size, rt, address)
                } else {
                    self.store_exclusive(bus, size, rd, rt, address)
                };
            }
            Insn::ClearExclusive => self.exclusive = None,
            Insn::HalfMul { .. } => self.multiply_halves(insn),
            Insn::DualMul { .. } => self.multiply_dual(insn),
            Insn::Sat { .. } => self.saturate(insn),
            Insn::SatQ { op, rd, rn, rm } => self.add_saturating(op, rd, rn, rm),
            Insn::Simd { mode, shape, rd, rn, rm } => self.add_lanes(mode, shape, rd, rn, rm),
            Insn::Sel { rd, rn, rm } => self.select(rd, rn, rm),
            Insn::Usad { rd, rn, rm, ra } => self.sum_differences(rd, rn, rm, ra),
            Insn::Pkh { tb, rd, rn, rm, shift } => self.pack(tb, rd, rn, rm, shift),
            Insn::Mrs { rd, sysm } => {
                let value = self.read_special(sysm);
                self.registers.set(rd, value);
            }
            Insn::Msr { rn, sysm, mask } => self.write_special(sysm, mask, self.registers.get(rn)),
            Insn::Cps { enable, i, f } => self.change_masks(enable, i, f),
            // Accesses take place one by one, in the order of the program.
            Insn::Barrier { .. } => {}
            Insn::Hint { op } => self.hint(op),
            Insn::Bkpt { .. } => self.break_point(bus),
            Insn::Svc { .. } => self.call_supervisor(bus),
            Insn::Coproc { cp: 10 | 11 } | Insn::Fp(_) => return Err(self.no_floating_point()),
            Insn::Coproc { .. } => return Err(Trap::NoCoprocessor),
            Insn::Udf { .. } | Insn::Undefined => return Err(Trap::Undefined),
            _ => {
                self.refuse("this instruction is not modelled");
                return Err(Trap::Undefined);
            }
        }
        Ok(())
    }

    /// The address an offset away from the PC, which counts as a multiple of 4.
    #[inline]
    pub(super) fn beside_pc(&self, offset: u32, add: bool) -> u32 {
        moved(self.registers.get(PC) & !3, offset, add)
    }

    /// Goes on at `target`.
    #[inline]
    pub(super) fn branch(&mut self, target: u32) {
        self.next = target & !1;
        self.used += REFILL;
    }

    /// Goes on at `target`, whose lowest bit says that it is Thumb code; or returns from an exception.
    #[inline]
    pub(super) fn branch_exchange<B: Bus>(&mut self, bus: &mut B, target: u32) -> Outcome {
        if target >= 0xF000_0000 && self.registers.in_handler() {
            return self.leave_exception(bus, target);
        }
        if target & 1 == 0 {
            return Err(Trap::State);
        }
        self.branch(target);
        Ok(())
    }

    fn branch_by_table<B: Bus>(&mut self, bus: &mut B, rn: u8, rm: u8, half: bool) -> Outcome {
        let (base, index) = (self.registers.get(rn), self.registers.get(rm));
        let distance = if half {
            let entry = base.wrapping_add(index << 1);
            self.check_aligned(entry, 2)?;
            self.read(bus, entry, 2)?
        } else {
            self.read(bus, base.wrapping_add(index), 1)?
        };
        self.branch(self.registers.get(PC).wrapping_add(2 * distance));
        Ok(())
    }

    /// Faults if an address is no multiple of the size.
    #[inline]
    pub(super) fn check_aligned(&self, address: u32, bytes: u32) -> Outcome {
        if address & (bytes - 1) == 0 { Ok(()) } else { Err(Trap::Unaligned) }
    }

    /// The floating-point unit is off, as it is after a reset; or the program has switched it on, and that is the end
    /// of the run.
    pub(super) fn no_floating_point(&mut self) -> Trap {
        if self.sys.fp_enabled(self.registers.privileged()) {
            self.refuse("floating point is not modelled");
        }
        Trap::NoCoprocessor
    }
}

/// An address and an offset.
#[inline]
pub(super) fn moved(address: u32, offset: u32, add: bool) -> u32 {
    if add { address.wrapping_add(offset) } else { address.wrapping_sub(offset) }
}

/// A short instruction as it is in an IT block.
fn without_flags(insn: Insn) -> Insn {
    match insn {
        Insn::DataProc { op, rd, rn, operand, .. } if !op.is_test() => Insn::DataProc { op, s: false, rd, rn, operand },
        Insn::ShiftReg { ty, rd, rn, rm, .. } => Insn::ShiftReg { ty, s: false, rd, rn, rm },
        Insn::Mul { rd, rn, rm, ra, sub, .. } => Insn::Mul { rd, rn, rm, ra, sub, s: false },
        other => other,
    }
}
