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
//! | `core` | the core's state, steps, counters |
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
mod core;
mod data;
mod dsp;
mod exception;
mod execute;
mod memory;
mod registers;
mod system;
mod transfer;
mod trap;

use self::core::Core;
use super::accelerator::Setup;
use super::peripheral::Cycles;
use super::step::{LINES, View};
use code::{Code, Decoded};
use memory::{FLASH, Memory, flash_offset};
use registers::PC;
use trap::{Outcome, Trap};

pub(super) use bus::Bus;
pub(super) use memory::{FLASH_SIZE, Ram};
pub(super) use registers::Registers;

/// The core with its memories. From outside it is to be seen and changed as with a debug probe.
#[derive(Debug)]
pub struct Cpu {
    core: Core,
    code: Code,
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
        Self { core: Core::new(Memory::new(flash)), code: Code::default() }
    }

    /// The memory that DMA can reach.
    pub(super) fn sram(&self) -> &Ram {
        &self.core.memory.sram
    }

    /// Starts anew, from the reset vector.
    pub(super) fn reset(&mut self) {
        self.core.reset();
    }

    /// Goes on from `now` to `end`, but no further than to an access to the bus, or to where it sleeps.
    #[inline]
    pub(super) fn run<B: Bus>(&mut self, bus: &mut B, mut now: Cycles, end: Cycles) -> Ran {
        let mut steps = 0;
        while now < end {
            now += self.step(bus, now);
            steps += 1;
            if self.core.accessed || self.core.asleep || self.core.refused.is_some() {
                break;
            }
        }
        Ran { now, steps }
    }

    /// Executes an instruction, or enters an exception. Gives the cycles that takes.
    #[inline]
    pub(super) fn step<B: Bus>(&mut self, bus: &mut B, now: Cycles) -> Cycles {
        let core = &mut self.core;
        core.now = now;
        core.used = 0;
        core.entered = 0;
        core.accessed = false;
        if !core.attention || core.attend(bus) {
            self.execute(bus);
        }
        let core = &mut self.core;
        core.unticked += core.used;
        if core.unticked >= core.tick_by {
            core.tick();
        }
        core.used
    }

    /// Executes the instruction at the PC.
    #[inline]
    fn execute<B: Bus>(&mut self, bus: &mut B) {
        let pc = self.pc();
        self.core.used += 1;
        let outcome = match self.code.find(pc.wrapping_sub(FLASH) as usize) {
            Some(decoded) => {
                self.core.wait_for_code(pc, decoded.bytes);
                self.core.perform(bus, decoded)
            }
            None => self.decode(pc).and_then(|decoded| {
                self.core.wait_for_code(pc, decoded.bytes);
                self.core.perform(bus, &decoded)
            }),
        };
        if let Err(trap) = outcome {
            self.core.fault(bus, trap);
        }
    }

    /// Decodes the instruction at an address, and keeps it if it is in the flash memory, where nothing changes it.
    #[inline(never)]
    fn decode(&mut self, pc: u32) -> Outcome<Decoded> {
        let half = |at| self.core.memory.load(at, 2);
        let decoded = half(pc).and_then(|first| Decoded::decode(first, || half(pc.wrapping_add(2))));
        let decoded = decoded.ok_or(Trap::Fetch)?;
        if let Some(offset) = flash_offset(pc).filter(|_| pc >= FLASH) {
            self.code.keep(offset, decoded);
        }
        Ok(decoded)
    }

    /// Lets at most `span` cycles pass without executing anything, fewer if the system timer wants attention
    /// before. Gives how many have passed.
    pub(super) fn idle(&mut self, span: Cycles) -> Cycles {
        self.core.idle(span)
    }

    /// Gives what an observer sees of the core.
    pub(super) fn view(&self) -> View {
        self.core.view()
    }

    /// Levels of the interrupt lines.
    pub(super) fn set_interrupts(&mut self, lines: [u32; LINES]) {
        self.core.set_interrupts(lines);
    }

    /// How the flash interface is set up.
    pub(super) fn set_up_flash(&mut self, setup: Setup) {
        self.core.accelerator.set_up(setup);
    }

    /// Whether waits for the flash memory take time.
    pub(super) fn set_stalls(&mut self, take_time: bool) {
        self.core.stalls_take_time = take_time;
    }

    /// Cycles waited for the flash memory.
    pub(super) fn stalls(&self) -> Cycles {
        self.core.stalls
    }

    /// The interrupt that cannot be masked.
    pub(super) fn raise_nmi(&mut self) {
        self.core.raise_nmi();
    }

    /// Something on the bus has been accessed in the last step.
    pub(super) fn has_accessed(&self) -> bool {
        self.core.accessed
    }

    /// Whether the core waits for an interrupt or an event.
    pub fn is_asleep(&self) -> bool {
        self.core.asleep
    }

    /// Whether it is stuck in faults.
    pub(super) fn is_locked_up(&self) -> bool {
        self.core.locked_up
    }

    /// Whether the program has asked for a reset.
    pub(super) fn wants_reset(&self) -> bool {
        self.core.sys.reset_requested
    }

    /// The address of an instruction that cannot be executed here, and why.
    pub(super) fn refused(&self) -> Option<(u32, &'static str)> {
        self.core.refused
    }

    /// Where the program stands.
    pub fn pc(&self) -> u32 {
        self.core.registers.get(PC)
    }

    /// All registers.
    pub(super) fn registers(&self) -> &Registers {
        &self.core.registers
    }

    /// Programs the flash memory from `address` on. Gives what was there; none if it is not all flash memory.
    pub fn program(&mut self, address: u32, bytes: &[u8]) -> Option<Vec<u8>> {
        self.code.forget();
        self.core.memory.program(address, bytes)
    }

    /// Puts another word at `address` in RAM, as a disturbance does. Gives what was there; none where there is no RAM.
    pub fn disturb(&mut self, address: u32, word: u32) -> Option<u32> {
        let before = self.core.memory.sram.word(address)?;
        self.core.memory.sram.write(address, &word.to_le_bytes())?;
        Some(before)
    }

    /// The word at `address` in memory; none where there is no memory.
    pub fn peek(&self, address: u32) -> Option<u32> {
        self.core.memory.load(address, 4)
    }
}

#[cfg(test)]
mod tests;
