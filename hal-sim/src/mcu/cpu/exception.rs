//! Exceptions: taken, entered, left (DDI 0403 B1.5).
//!
//! Their cycles are those of the Cortex-M4's manual for memory without wait states (DDI 0439 3.9.1, which TI repeats in
//! SLAU356 1.5.8). They are twelve from the request to the first instruction of the handler, with what is saved, and
//! six if the handler begins where another ends. They are twelve for a return, with what is restored, besides the
//! cycles of the instruction that returns. An exception that arrives while another one is being entered is not let in
//! before that, as the chip would.

use rsemu::cpu::arm::v7m::sys::{Exception, ccr, control, exc_return, fsr};
use rsemu::cpu::arm::v7m::xpsr;

use super::bus::Bus;
use super::core::Core;
use super::registers::{LR, PC, SP};
use super::trap::{Outcome, Trap};
use crate::mcu::peripheral::Cycles;
use crate::mcu::step::LINES;

/// Cycles of an entry and of a return, and of an entry right after a return.
const ENTRY: Cycles = 12;
const RETURN: Cycles = 12;
const CHAINED: Cycles = 6;

/// Where a core that is locked up stands.
const LOCKED_UP: u32 = 0xFFFF_FFFE;
/// In a saved xPSR: the stack pointer was no multiple of 8.
const ALIGNED: u32 = 1 << 9;
/// Registers that an exception saves, before the PC and xPSR.
const SAVED: [u8; 6] = [0, 1, 2, 3, 12, LR];
/// The first interrupt among the exceptions.
const FIRST_INTERRUPT: u16 = 16;

impl Core {
    /// Looks after what is more urgent than the next instruction. True if that is to be executed nevertheless.
    #[inline(never)]
    pub(super) fn attend<B: Bus>(&mut self, bus: &mut B) -> bool {
        if self.reset_pending {
            self.reset_sequence();
            return false;
        }
        if self.locked_up {
            self.used += 1;
            return false;
        }
        self.latch_interrupts();
        let pending = self.sys.highest_pending();
        let pc = self.registers.get(PC);
        if let Some((exception, priority)) = pending
            && priority < self.registers.priority(&self.sys)
        {
            self.enter_exception(bus, exception, pc);
            self.registers.set(PC, self.next);
            return false;
        }
        // It wakes up even if a mask keeps the exception out.
        self.asleep &= pending.is_none();
        if self.asleep {
            self.used += 1;
            return false;
        }
        self.attention = false;
        if !self.registers.has(xpsr::T) {
            self.used += 1;
            self.fault(bus, Trap::State);
            return false;
        }
        true
    }

    /// Stack pointer and first instruction from the vectors.
    fn reset_sequence(&mut self) {
        self.reset_pending = false;
        let [stack, start] = [0, 4].map(|vector| self.memory.load(vector, 4).unwrap_or(0));
        self.registers.set(SP, stack & !3);
        self.registers.set(PC, start & !1);
        self.registers.put(xpsr::T, (start & 1) << 24);
        self.used += 2;
    }

    /// Interrupts that are wanted by their lines are pending, unless their handlers have begun.
    fn latch_interrupts(&mut self) {
        let mut lower = 0;
        for (word, lines) in self.lines.iter().copied().chain([0]).enumerate() {
            self.sys.pending[word] |= (lines << 16 | lower) & !self.sys.active[word];
            lower = lines >> 16;
        }
    }

    /// The instruction at the PC cannot be executed.
    #[inline(never)]
    pub(super) fn fault<B: Bus>(&mut self, bus: &mut B, trap: Trap) {
        let pc = self.registers.get(PC);
        let (mut exception, status) = trap.exception();
        self.sys.cfsr |= status;
        if trap == Trap::Access {
            self.sys.bfar = self.far;
        }
        let priority = self.registers.priority(&self.sys);
        if !self.sys.is_enabled(exception) || self.sys.priority_of(exception) >= priority {
            self.sys.hfsr |= fsr::HF_FORCED;
            exception = Exception::HARD_FAULT;
        }
        if exception == Exception::HARD_FAULT && priority <= -1 {
            self.lock_up();
        } else {
            self.enter_exception(bus, exception, pc);
        }
        self.registers.set(PC, self.next);
    }

    fn lock_up(&mut self) {
        self.locked_up = true;
        self.attention = true;
        self.next = LOCKED_UP;
    }

    /// Saves what the handler may change, and goes on with the handler.
    #[inline(never)]
    pub(super) fn enter_exception<B: Bus>(&mut self, bus: &mut B, exception: Exception, back: u32) {
        self.asleep = false;
        let begun = self.used;
        let xpsr = self.registers.xpsr();
        let stack = self.registers.get(SP);
        let aligned = self.sys.ccr & ccr::STKALIGN != 0 && stack & 4 != 0;
        let frame = stack.wrapping_sub(exc_return::BASIC_FRAME + if aligned { 4 } else { 0 });
        self.registers.set(SP, frame);
        let saved = SAVED.map(|register| self.registers.get(register));
        let words = saved.into_iter().chain([back, xpsr & !ALIGNED | if aligned { ALIGNED } else { 0 }]);
        let mut places = (frame..).step_by(4);
        let mut lost = false;
        for (word, place) in words.zip(&mut places) {
            lost |= self.write(bus, place, 4, word).is_err();
        }
        if lost {
            self.sys.cfsr |= fsr::BF_STKERR;
            self.sys.hfsr |= fsr::HF_FORCED;
        }
        let link = if self.registers.in_handler() {
            exc_return::HANDLER_MSP
        } else if self.registers.control & control::SPSEL != 0 {
            exc_return::THREAD_PSP
        } else {
            exc_return::THREAD_MSP
        };
        self.begin_handler(exception, link);
        self.used = begun + ENTRY;
    }

    /// The handler of an exception begins, with `link` to return by.
    fn begin_handler(&mut self, exception: Exception, link: u32) {
        let Exception(number) = exception;
        self.entered = number;
        self.attention = true;
        self.exclusive = None;
        self.sys.set_pending(exception, false);
        self.sys.set_active(exception, true);
        self.registers.set(LR, link);
        self.registers.it = 0;
        self.registers.put(xpsr::EXCEPTION, number.into());
        self.registers.choose_stack();
        match self.memory.load(self.sys.vtor.wrapping_add(exception.vector_offset()), 4) {
            Some(handler) => {
                self.next = handler & !1;
                self.registers.put(xpsr::T, (handler & 1) << 24);
            }
            None => {
                self.sys.hfsr |= fsr::HF_VECTTBL;
                self.lock_up();
            }
        }
    }

    /// Returns from a handler, to where `link` says.
    #[inline(never)]
    pub(super) fn leave_exception<B: Bus>(&mut self, bus: &mut B, link: u32) -> Outcome {
        let number = self.registers.exception();
        let left = Exception(number);
        if !self.sys.is_active(left) {
            return Err(Trap::Return);
        }
        let (to_handler, process) = match link | exc_return::FP_FRAME {
            exc_return::HANDLER_MSP => (true, false),
            exc_return::THREAD_MSP => (false, false),
            exc_return::THREAD_PSP => (false, true),
            _ => return Err(Trap::Return),
        };
        if link & exc_return::FP_FRAME == 0 {
            return Err(self.no_floating_point());
        }
        let nested = self.sys.active_count() > 1;
        let from_depth = self.sys.ccr & ccr::NONBASETHRDENA != 0;
        if to_handler != nested && !(nested && from_depth) {
            return Err(Trap::Return);
        }
        self.attention = true;
        self.sys.set_active(left, false);
        let line = number.checked_sub(FIRST_INTERRUPT).map(usize::from).filter(|line| line / 32 < LINES);
        if line.is_some_and(|line| self.lines[line / 32] >> (line % 32) & 1 != 0) {
            self.sys.set_pending(left, true);
        }
        if left != Exception::NMI {
            self.registers.faultmask = false;
        }
        // What can be entered now begins without going back.
        if let Some((exception, priority)) = self.sys.highest_pending()
            && priority < self.registers.priority(&self.sys)
        {
            self.begin_handler(exception, link);
            self.used += CHAINED;
            return Ok(());
        }
        if !to_handler {
            self.registers.put(xpsr::EXCEPTION, 0);
        }
        self.registers.control &= !control::SPSEL;
        self.registers.control |= if process { control::SPSEL } else { 0 };
        self.registers.choose_stack();
        let begun = self.used;
        self.restore(bus);
        self.exclusive = None;
        self.used = begun + RETURN;
        Ok(())
    }

    /// Takes back what the entry has saved.
    fn restore<B: Bus>(&mut self, bus: &mut B) {
        let stack = self.registers.get(SP);
        let mut lost = false;
        let frame: [u32; SAVED.len() + 2] = std::array::from_fn(|word| {
            let word = self.read(bus, stack.wrapping_add(4 * word as u32), 4);
            lost |= word.is_err();
            word.unwrap_or(0)
        });
        if lost {
            self.sys.cfsr |= fsr::BF_UNSTKERR;
            self.sys.hfsr |= fsr::HF_FORCED;
        }
        let [saved @ .., back, saved_xpsr] = frame;
        for (register, word) in SAVED.into_iter().zip(saved) {
            self.registers.set(register, word);
        }
        let aligned = self.sys.ccr & ccr::STKALIGN != 0 && saved_xpsr & ALIGNED != 0;
        self.registers.set(SP, stack.wrapping_add(exc_return::BASIC_FRAME + if aligned { 4 } else { 0 }));
        self.registers.set_xpsr(saved_xpsr & (xpsr::WRITABLE | xpsr::EXCEPTION));
        self.registers.choose_stack();
        self.next = back & !1;
    }
}
