//! The core, which executes: registers, system control space and memories, step by step.

use rsemu::cpu::arm::v7m::sys::{Exception, Sys};
use rsemu::cpu::arm::v7m::{Config, FpUnit};

use super::memory::{Memory, is_flash};
use super::registers::{PC, Registers};
use crate::mcu::accelerator::Accelerator;
use crate::mcu::peripheral::{Cycles, NEVER};
use crate::mcu::step::{LINES, View};

/// Bits of the priority of an interrupt, and regions of the memory protection unit, which the firmware may count.
pub(super) const PRIORITY_BITS: u8 = 4;
const REGIONS: u8 = 8;

/// Control bits of SysTick: counts, interrupts.
const COUNTS: u32 = 1;
const SYSTICK_ON: u32 = 0b11;

/// The core, without the instructions that it has decoded.
#[derive(Debug)]
pub(super) struct Core {
    pub(super) registers: Registers,
    pub(super) sys: Sys,
    pub(super) memory: Memory,
    /// Levels of the interrupt lines.
    pub(super) lines: [u32; LINES],
    /// Something has changed that may be more urgent than the next instruction.
    pub(super) attention: bool,
    pub(super) reset_pending: bool,
    pub(super) locked_up: bool,
    pub(super) asleep: bool,
    /// Whether SEV has left an event for WFE.
    pub(super) event: bool,
    /// The address that a load has marked for a store.
    pub(super) exclusive: Option<u32>,
    /// Cycles that the counters of the core have not counted yet, and with how many something comes of it.
    pub(super) unticked: Cycles,
    pub(super) tick_by: Cycles,
    /// The accelerator before the flash memory; the cycles waited for that memory, and whether they take time.
    pub(super) accelerator: Accelerator,
    pub(super) stalls: Cycles,
    pub(super) stalls_take_time: bool,
    /// The instruction that ended the run, and why.
    pub(super) refused: Option<(u32, &'static str)>,
    /// The present step: when it began, its cycles, where the program goes on, and the exception entered (or 0). The
    /// last two are whether something on the bus has been accessed, and the address that could not be.
    pub(super) now: Cycles,
    pub(super) used: Cycles,
    pub(super) next: u32,
    pub(super) entered: u16,
    pub(super) accessed: bool,
    pub(super) far: u32,
}

impl Core {
    /// A core that has just been reset.
    pub(super) fn new(memory: Memory) -> Self {
        Self {
            registers: Registers::new(),
            sys: system_control(),
            memory,
            lines: [0; LINES],
            attention: true,
            reset_pending: true,
            locked_up: false,
            asleep: false,
            event: false,
            exclusive: None,
            unticked: 0,
            tick_by: NEVER,
            accelerator: Accelerator::new(),
            stalls: 0,
            stalls_take_time: false,
            refused: None,
            now: 0,
            used: 0,
            next: 0,
            entered: 0,
            accessed: false,
            far: 0,
        }
    }

    /// Starts anew, from the reset vector.
    pub(super) fn reset(&mut self) {
        self.registers = Registers::new();
        self.sys = system_control();
        self.lines = [0; LINES];
        self.attention = true;
        self.reset_pending = true;
        self.locked_up = false;
        self.asleep = false;
        self.event = false;
        self.exclusive = None;
        self.unticked = 0;
        self.tick_by = NEVER;
        self.accelerator = Accelerator::new();
    }

    /// An instruction is fetched.
    #[inline]
    pub(super) fn wait_for_code(&mut self, address: u32, bytes: u32) {
        if is_flash(address) {
            let now = self.now + self.used + if self.stalls_take_time { 0 } else { self.stalls };
            let stall = self.accelerator.fetch(address, bytes, now);
            self.stall(stall);
        }
    }

    /// Data are read.
    #[inline]
    pub(super) fn wait_for_data(&mut self, address: u32) {
        if is_flash(address) {
            let stall = self.accelerator.load(address);
            self.stall(stall);
        }
    }

    #[inline]
    fn stall(&mut self, cycles: Cycles) {
        self.stalls += cycles;
        if self.stalls_take_time {
            self.used += cycles;
        }
    }

    /// Lets at most `span` cycles pass without executing anything, fewer if the system timer wants attention
    /// before. Gives how many have passed.
    pub(super) fn idle(&mut self, span: Cycles) -> Cycles {
        self.tick();
        let ticking = self.sys.syst_csr & SYSTICK_ON == SYSTICK_ON;
        let span = if ticking { span.min(Cycles::from(self.sys.syst_cvr).max(1)) } else { span };
        self.unticked = span;
        self.tick();
        span
    }

    /// Lets the core's counters count.
    pub(super) fn tick(&mut self) {
        let passed = std::mem::take(&mut self.unticked);
        self.sys.tick_cyccnt(passed);
        if self.sys.tick_systick(passed) && self.sys.syst_csr & SYSTICK_ON == SYSTICK_ON {
            self.sys.set_pending(Exception::SYSTICK, true);
            self.attention = true;
        }
        self.plan_tick();
    }

    /// Finds out when a counter of the core brings something about.
    pub(super) fn plan_tick(&mut self) {
        let counts = self.sys.syst_csr & COUNTS != 0 && self.sys.syst_rvr != 0;
        self.tick_by = if counts { Cycles::from(self.sys.syst_cvr).max(1) } else { NEVER };
    }

    /// The present instruction ends the run.
    pub(super) fn refuse(&mut self, reason: &'static str) {
        self.refused.get_or_insert((self.registers.get(PC).wrapping_sub(4), reason));
    }

    /// Gives what an observer sees of the core.
    pub(super) fn view(&self) -> View {
        let pending = lines(&self.sys.pending);
        View {
            entered: (self.entered != 0).then_some(self.entered),
            exception: self.registers.exception(),
            masked: self.registers.primask,
            enabled: lines(&self.sys.enable),
            wanted: std::array::from_fn(|word| pending[word] | self.lines[word]),
        }
    }

    /// Levels of the interrupt lines.
    pub(super) fn set_interrupts(&mut self, lines: [u32; LINES]) {
        if lines != self.lines {
            self.lines = lines;
            self.attention = true;
        }
    }

    /// The interrupt that cannot be masked.
    pub(super) fn raise_nmi(&mut self) {
        self.sys.set_pending(Exception::NMI, true);
        self.attention = true;
    }
}

/// The interrupts in a set of exceptions, of which the first 16 are the core's own.
fn lines<const WORDS: usize>(set: &[u32; WORDS]) -> [u32; LINES] {
    std::array::from_fn(|word| set[word] >> 16 | set[word + 1] << 16)
}

fn system_control() -> Sys {
    Sys::new(Config::CORTEX_M4F.cpuid, PRIORITY_BITS, REGIONS).with_fp(FpUnit::V4Sp.mvfr())
}
