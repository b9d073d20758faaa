//! The core: a Cortex-M4 with its interrupt controller and system timer, and the memories it executes from.
//!
//! It executes what the library rsemu has decoded, around that library's system control space: many instructions a
//! call, without locks. What else of the library there is serves as the other side in the tests.
//!
//! | file | what |
//! |---|---|
//! | `memory` | flash, RAM |
//! | `bus` | what accesses to peripherals go to |
//! | `access` | loads and stores, wherever they lead |
//! | `code` | decoded instructions |
//! | `registers` | registers, flags, the state of an IT block |
//! | `execute` | instructions in general, branches |
//! | `data`, `dsp`, `transfer`, `system` | instructions by their kinds |
//! | `exception`, `trap` | exceptions, and what raises those that are faults |
//!
//! Floating point, the memory protection unit and single bits by addresses of their own are not modelled: their use
//! ends the run.

mod access;
mod bus;
mod code;
mod data;
mod dsp;
mod exception;
mod execute;
mod memory;
mod registers;
mod system;
mod transfer;
mod trap;

use rsemu::cpu::arm::v7m::sys::{Exception, Sys};
use rsemu::cpu::arm::v7m::{Config, FpUnit};

use super::peripheral::{Cycles, NEVER};
use super::step::{LINES, View};
use code::Code;
use memory::Memory;
use registers::PC;

pub(super) use bus::Bus;
pub(super) use memory::{FLASH_SIZE, Ram};
pub(super) use registers::Registers;

/// Bits of the priority of an interrupt, and regions of the memory protection unit, which the firmware may count.
const PRIORITY_BITS: u8 = 4;
const REGIONS: u8 = 8;

/// Control bits of SysTick: counts, interrupts.
const COUNTS: u32 = 1;
const SYSTICK_ON: u32 = 0b11;

/// The core with its memories. From outside it is to be seen and changed as with a debug probe.
#[derive(Debug)]
pub struct Cpu {
    registers: Registers,
    sys: Sys,
    memory: Memory,
    code: Code,
    /// Levels of the interrupt lines.
    lines: [u32; LINES],
    /// Something has changed that may be more urgent than the next instruction.
    attention: bool,
    reset_pending: bool,
    locked_up: bool,
    asleep: bool,
    /// What SEV leaves for WFE.
    event: bool,
    /// The address that a load has marked for a store.
    exclusive: Option<u32>,
    /// Cycles that the counters of the core have not counted yet, and with how many something comes of it.
    unticked: Cycles,
    tick_by: Cycles,
    /// The instruction that ended the run, and why.
    refused: Option<(u32, &'static str)>,
    /// Of the present step: when it began, its cycles, where the program goes on, the exception entered (or 0), whether
    /// something on the bus has been accessed, the address that could not be.
    now: Cycles,
    used: Cycles,
    next: u32,
    entered: u16,
    accessed: bool,
    far: u32,
}

/// How far the core has come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ran {
    /// Until when.
    pub(super) now: Cycles,
    /// Steps that it has taken.
    pub(super) steps: u64,
}

impl Cpu {
    /// A core that has just been reset, with `flash` as the contents of the flash memory.
    pub(super) fn new(flash: Vec<u8>) -> Self {
        Self {
            registers: Registers::new(),
            sys: system_control(),
            memory: Memory::new(flash),
            code: Code::default(),
            lines: [0; LINES],
            attention: true,
            reset_pending: true,
            locked_up: false,
            asleep: false,
            event: false,
            exclusive: None,
            unticked: 0,
            tick_by: NEVER,
            refused: None,
            now: 0,
            used: 0,
            next: 0,
            entered: 0,
            accessed: false,
            far: 0,
        }
    }

    /// The memory that DMA can reach.
    pub(super) fn sram(&self) -> &Ram {
        &self.memory.sram
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
    }

    /// Goes on from `now` to `end`, but no further than to an access to the bus, or to where it sleeps.
    #[inline]
    pub(super) fn run<B: Bus>(&mut self, bus: &mut B, mut now: Cycles, end: Cycles) -> Ran {
        let mut steps = 0;
        while now < end {
            now += self.step(bus, now);
            steps += 1;
            if self.accessed || self.asleep || self.refused.is_some() {
                break;
            }
        }
        Ran { now, steps }
    }

    /// Executes an instruction, or enters an exception. Gives the cycles that takes.
    #[inline]
    pub(super) fn step<B: Bus>(&mut self, bus: &mut B, now: Cycles) -> Cycles {
        self.now = now;
        self.used = 0;
        self.entered = 0;
        self.accessed = false;
        if !self.attention || self.attend(bus) {
            self.execute_one(bus);
        }
        self.unticked += self.used;
        if self.unticked >= self.tick_by {
            self.tick();
        }
        self.used
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
    fn tick(&mut self) {
        let passed = std::mem::take(&mut self.unticked);
        self.sys.tick_cyccnt(passed);
        if self.sys.tick_systick(passed) && self.sys.syst_csr & SYSTICK_ON == SYSTICK_ON {
            self.sys.set_pending(Exception::SYSTICK, true);
            self.attention = true;
        }
        self.plan_tick();
    }

    /// Finds out when a counter of the core brings something about.
    fn plan_tick(&mut self) {
        let counts = self.sys.syst_csr & COUNTS != 0 && self.sys.syst_rvr != 0;
        self.tick_by = if counts { Cycles::from(self.sys.syst_cvr).max(1) } else { NEVER };
    }

    /// Something on the bus has been accessed in the last step.
    pub(super) fn has_accessed(&self) -> bool {
        self.accessed
    }

    /// Whether the core waits for an interrupt or an event.
    pub fn is_asleep(&self) -> bool {
        self.asleep
    }

    /// Whether it is stuck in faults.
    pub(super) fn is_locked_up(&self) -> bool {
        self.locked_up
    }

    /// Whether the program has asked for a reset.
    pub(super) fn wants_reset(&self) -> bool {
        self.sys.reset_requested
    }

    /// The address of an instruction that cannot be executed here, and why.
    pub(super) fn refused(&self) -> Option<(u32, &'static str)> {
        self.refused
    }

    /// The present instruction ends the run.
    fn refuse(&mut self, reason: &'static str) {
        self.refused.get_or_insert((self.registers.get(PC).wrapping_sub(4), reason));
    }

    /// Where the program stands.
    pub fn pc(&self) -> u32 {
        self.registers.get(PC)
    }

    /// All registers.
    pub(super) fn registers(&self) -> &Registers {
        &self.registers
    }

    /// What an observer sees of it.
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

    /// Programs the flash memory from `address` on. Gives what was there; none if it is not all flash memory.
    pub fn program(&mut self, address: u32, bytes: &[u8]) -> Option<Vec<u8>> {
        self.code.forget();
        self.memory.program(address, bytes)
    }

    /// Puts another word at `address` in RAM, as a disturbance does. Gives what was there; none where there is no RAM.
    pub fn disturb(&mut self, address: u32, word: u32) -> Option<u32> {
        let before = self.memory.sram.word(address)?;
        self.memory.sram.write(address, &word.to_le_bytes())?;
        Some(before)
    }

    /// The word at `address` in memory; none where there is no memory.
    pub fn peek(&self, address: u32) -> Option<u32> {
        self.memory.load(address, 4)
    }
}

/// The interrupts in a set of exceptions, of which the first 16 are the core's own.
fn lines<const WORDS: usize>(set: &[u32; WORDS]) -> [u32; LINES] {
    std::array::from_fn(|word| set[word] >> 16 | set[word + 1] << 16)
}

fn system_control() -> Sys {
    Sys::new(Config::CORTEX_M4F.cpuid, PRIORITY_BITS, REGIONS).with_fp(FpUnit::V4Sp.mvfr())
}

#[cfg(test)]
mod tests;
