//! Instructions that load and store.

use rsemu::cpu::arm::v7m::isa::{Insn, MemOffset, Size};
use rsemu::cpu::arm::v7m::sys::ccr;

use super::bus::Bus;
use super::core::Core;
use super::execute::moved;
use super::registers::PC;
use super::trap::{Outcome, Trap};

/// The most registers of a transfer.
const REGISTERS: u8 = 16;

impl Core {
    /// Loads a register.
    #[inline]
    pub(super) fn load<B: Bus>(&mut self, bus: &mut B, insn: &Insn) -> Outcome {
        let Insn::LoadStore { size, signed, rt, rn, offset, index, add, wback, .. } = *insn else { return Ok(()) };
        let (address, after) = self.place(rn, offset, index, add);
        self.check_access(address, size)?;
        let value = extended(self.read(bus, address, size.bytes())?, size, signed);
        if wback {
            self.registers.set(rn, after);
        }
        self.take(bus, rt, value)
    }

    /// Stores a register.
    #[inline]
    pub(super) fn store<B: Bus>(&mut self, bus: &mut B, insn: &Insn) -> Outcome {
        let Insn::LoadStore { size, rt, rn, offset, index, add, wback, .. } = *insn else { return Ok(()) };
        let (address, after) = self.place(rn, offset, index, add);
        self.check_access(address, size)?;
        self.write(bus, address, size.bytes(), self.registers.get(rt))?;
        if wback {
            self.registers.set(rn, after);
        }
        Ok(())
    }

    /// Loads what lies near the code.
    #[inline]
    pub(super) fn load_literal<B: Bus>(
        &mut self,
        bus: &mut B,
        size: Size,
        signed: bool,
        rt: u8,
        offset: u32,
        add: bool,
    ) -> Outcome {
        let address = self.beside_pc(offset, add);
        self.check_access(address, size)?;
        let value = extended(self.read(bus, address, size.bytes())?, size, signed);
        self.take(bus, rt, value)
    }

    /// Loads two registers.
    pub(super) fn load_pair<B: Bus>(&mut self, bus: &mut B, insn: &Insn) -> Outcome {
        let Insn::LoadStoreDual { rt, rt2, rn, imm, index, add, wback, .. } = *insn else { return Ok(()) };
        let (address, after) = self.place_of_pair(rn, imm, index, add)?;
        let first = self.read(bus, address, 4)?;
        let second = self.read(bus, address.wrapping_add(4), 4)?;
        self.registers.set(rt, first);
        self.registers.set(rt2, second);
        if wback {
            self.registers.set(rn, after);
        }
        Ok(())
    }

    /// Stores two registers.
    pub(super) fn store_pair<B: Bus>(&mut self, bus: &mut B, insn: &Insn) -> Outcome {
        let Insn::LoadStoreDual { rt, rt2, rn, imm, index, add, wback, .. } = *insn else { return Ok(()) };
        let (address, after) = self.place_of_pair(rn, imm, index, add)?;
        self.write(bus, address, 4, self.registers.get(rt))?;
        self.write(bus, address.wrapping_add(4), 4, self.registers.get(rt2))?;
        if wback {
            self.registers.set(rn, after);
        }
        Ok(())
    }

    /// Loads a register and marks the address.
    pub(super) fn load_exclusive<B: Bus>(&mut self, bus: &mut B, size: Size, rt: u8, address: u32) -> Outcome {
        self.check_aligned(address, size.bytes())?;
        let value = self.read(bus, address, size.bytes())?;
        self.exclusive = Some(address);
        self.registers.set(rt, value);
        Ok(())
    }

    /// Stores a register if the address is still marked; `rd` tells whether it was not.
    pub(super) fn store_exclusive<B: Bus>(&mut self, bus: &mut B, size: Size, rd: u8, rt: u8, address: u32) -> Outcome {
        self.check_aligned(address, size.bytes())?;
        let marked = self.exclusive == Some(address);
        if marked {
            self.write(bus, address, size.bytes(), self.registers.get(rt))?;
        }
        self.exclusive = None;
        self.registers.set(rd, u32::from(!marked));
        Ok(())
    }

    /// Loads or stores a list of registers.
    #[inline]
    pub(super) fn transfer_many<B: Bus>(
        &mut self,
        bus: &mut B,
        load: bool,
        rn: u8,
        list: u16,
        wback: bool,
        before: bool,
    ) -> Outcome {
        if list == 0 {
            return Err(Trap::Undefined);
        }
        let base = self.registers.get(rn);
        let span = 4 * list.count_ones();
        let after = moved(base, span, !before);
        let mut address = if before { after } else { base };
        self.check_aligned(address, 4)?;
        if load && wback {
            self.registers.set(rn, after);
        }
        let mut target = None;
        for register in (0..REGISTERS).filter(|register| list >> register & 1 != 0) {
            if !load {
                self.write(bus, address, 4, self.registers.get(register))?;
            } else {
                let value = self.read(bus, address, 4)?;
                if register == PC {
                    target = Some(value);
                } else {
                    self.registers.set(register, value);
                }
            }
            address = address.wrapping_add(4);
        }
        if !load && wback {
            self.registers.set(rn, after);
        }
        target.map_or(Ok(()), |target| self.branch_exchange(bus, target))
    }

    /// Where an instruction accesses, and what it may leave in its base register.
    #[inline]
    fn place(&self, rn: u8, offset: MemOffset, index: bool, add: bool) -> (u32, u32) {
        let base = self.registers.get(rn);
        let offset = match offset {
            MemOffset::Imm(offset) => offset,
            MemOffset::Reg { rm, lsl } => self.registers.get(rm) << lsl,
        };
        let after = moved(base, offset, add);
        (if index { after } else { base }, after)
    }

    /// The same for two registers, which must be at a multiple of 4.
    fn place_of_pair(&self, rn: u8, offset: u32, index: bool, add: bool) -> Outcome<(u32, u32)> {
        let base = self.registers.get(rn);
        let base = if rn == PC { base & !3 } else { base };
        let after = moved(base, offset, add);
        let address = if index { after } else { base };
        self.check_aligned(address, 4)?;
        Ok((address, after))
    }

    /// Faults if the address is no multiple of the size and the program wants to know.
    #[inline]
    fn check_access(&self, address: u32, size: Size) -> Outcome {
        if self.sys.ccr & ccr::UNALIGN_TRP == 0 { Ok(()) } else { self.check_aligned(address, size.bytes()) }
    }

    /// Puts what has been loaded in a register.
    #[inline]
    fn take<B: Bus>(&mut self, bus: &mut B, rt: u8, value: u32) -> Outcome {
        if rt == PC {
            return self.branch_exchange(bus, value);
        }
        self.registers.set(rt, value);
        Ok(())
    }
}

/// Gives the value that has been loaded, as a word.
#[inline]
fn extended(value: u32, size: Size, signed: bool) -> u32 {
    match size {
        Size::Byte if signed => i32::from(value as u8 as i8) as u32,
        Size::Half if signed => i32::from(value as u16 as i16) as u32,
        _ => value,
    }
}
