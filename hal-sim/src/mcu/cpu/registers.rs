//! The registers, and what decides how a program goes on.

use rsemu::cpu::arm::v7m::isa::Cond;
use rsemu::cpu::arm::v7m::sys::{Sys, control};
use rsemu::cpu::arm::v7m::xpsr;

/// Numbers of registers with a role of their own.
pub(super) const SP: u8 = 13;
pub(super) const LR: u8 = 14;
pub(super) const PC: u8 = 15;

/// For each value of the flags N, Z, C, V the conditions that hold, one bit each.
const HOLDS: [u16; 16] = {
    let mut holds = [0; 16];
    let mut flags = 0;
    while flags < 16 {
        let mut condition = 0;
        while condition < 16 {
            if Cond(condition).passes((flags as u32) << 28) {
                holds[flags] |= 1 << condition;
            }
            condition += 1;
        }
        flags += 1;
    }
    holds
};

/// All registers but those of the system control space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mcu) struct Registers {
    /// R0 to R15. While an instruction is executed, the last one is its address and 4.
    r: [u32; 16],
    /// The stack pointer that is not in use, and which of the two that is.
    other_stack: u32,
    on_process_stack: bool,
    /// xPSR but for the state of an IT block.
    psr: u32,
    /// The state of an IT block; 0 outside.
    pub(super) it: u8,
    pub(super) primask: bool,
    pub(super) faultmask: bool,
    pub(super) basepri: u8,
    pub(super) control: u32,
}

impl Registers {
    /// Before the reset sequence.
    pub(super) fn new() -> Self {
        Self {
            r: [0; 16],
            other_stack: 0,
            on_process_stack: false,
            psr: xpsr::T,
            it: 0,
            primask: false,
            faultmask: false,
            basepri: 0,
            control: 0,
        }
    }

    /// A register.
    #[inline]
    pub(super) fn get(&self, register: u8) -> u32 {
        self.r[usize::from(register & 15)]
    }

    /// Changes a register. What an instruction writes to the PC in this way is lost: those that branch do otherwise.
    #[inline]
    pub(super) fn set(&mut self, register: u8, value: u32) {
        self.r[usize::from(register & 15)] = value;
    }

    /// xPSR.
    #[inline]
    pub(super) fn xpsr(&self) -> u32 {
        let it = u32::from(self.it);
        self.psr | (it >> 2) << 10 | (it & 3) << 25
    }

    /// Changes xPSR. The stack pointer has to be chosen anew.
    pub(super) fn set_xpsr(&mut self, value: u32) {
        self.psr = value & !xpsr::IT_MASK;
        self.it = ((value >> 10 & 0x3F) << 2 | value >> 25 & 3) as u8;
    }

    /// Whether one of these bits of xPSR is set, the IT state apart.
    #[inline]
    pub(super) fn has(&self, bits: u32) -> bool {
        self.psr & bits != 0
    }

    /// Puts the bits of `mask` in xPSR, the IT state apart.
    #[inline]
    pub(super) fn put(&mut self, mask: u32, bits: u32) {
        self.psr = self.psr & !mask | bits & mask;
    }

    /// Sets N and Z for a result.
    #[inline]
    pub(super) fn set_nz(&mut self, result: u32) {
        self.put(xpsr::N | xpsr::Z, result & xpsr::N | u32::from(result == 0) << 30);
    }

    /// Sets all four flags.
    #[inline]
    pub(super) fn set_nzcv(&mut self, result: u32, carry: bool, overflow: bool) {
        let flags =
            result & xpsr::N | u32::from(result == 0) << 30 | u32::from(carry) << 29 | u32::from(overflow) << 28;
        self.put(xpsr::N | xpsr::Z | xpsr::C | xpsr::V, flags);
    }

    /// Whether a condition holds.
    #[inline]
    pub(super) fn holds(&self, condition: Cond) -> bool {
        HOLDS[(self.psr >> 28) as usize] >> (condition.0 & 15) & 1 != 0
    }

    /// Whether the IT block lets the next instruction be executed.
    pub(super) fn holds_in_block(&self) -> bool {
        self.holds(Cond(self.it >> 4))
    }

    /// Goes on in an IT block by an instruction.
    pub(super) fn advance_block(&mut self) {
        self.it = if self.it & 0b111 == 0 { 0 } else { self.it & 0xE0 | self.it << 1 & 0x1F };
    }

    /// The exception that is handled; 0 in thread mode.
    #[inline]
    pub(super) fn exception(&self) -> u16 {
        (self.psr & xpsr::EXCEPTION) as u16
    }

    /// Whether an exception is handled.
    #[inline]
    pub(super) fn in_handler(&self) -> bool {
        self.has(xpsr::EXCEPTION)
    }

    /// Whether the program may do anything.
    pub(super) fn privileged(&self) -> bool {
        self.in_handler() || self.control & control::NPRIV == 0
    }

    /// Takes the stack pointer into use that mode and CONTROL select.
    pub(super) fn choose_stack(&mut self) {
        let process = !self.in_handler() && self.control & control::SPSEL != 0;
        if process != self.on_process_stack {
            std::mem::swap(&mut self.r[usize::from(SP)], &mut self.other_stack);
            self.on_process_stack = process;
        }
    }

    /// Gives one of the two stack pointers.
    pub(super) fn stack(&mut self, process: bool) -> &mut u32 {
        if process == self.on_process_stack { &mut self.r[usize::from(SP)] } else { &mut self.other_stack }
    }

    /// The priority that the program has (DDI 0403 B1.5.4).
    pub(super) fn priority(&self, sys: &Sys) -> i32 {
        let masks = [
            self.faultmask.then_some(-1),
            self.primask.then_some(0),
            (self.basepri != 0).then(|| i32::from(self.basepri & sys.group_mask())),
        ];
        masks.into_iter().flatten().fold(sys.active_priority(), i32::min)
    }
}
