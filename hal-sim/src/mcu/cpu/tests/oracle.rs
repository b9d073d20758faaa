//! The library's core with the same memories, step by step beside ours.

use std::sync::Arc;

use rsemu::core::space::{AddressSpace, RamStore, Region, RomStore, RomWrite};
use rsemu::cpu::arm::v7m::{ArmV7m, Regs};

use super::super::memory::{CCM, FLASH, SRAM, SRAM_SIZE};
use super::super::registers::{LR, SP};
use super::*;
use rsemu::cpu::arm::v7m::sys::exc_return;
use rsemu::cpu::arm::v7m::xpsr;

/// Where xPSR is in what an exception saves.
const SAVED_XPSR: u32 = 28;

/// Both cores.
pub(super) struct Pair {
    pub(super) cpu: Cpu,
    pub(super) bus: Peripherals,
    pub(super) library: ArmV7m,
    space: Arc<AddressSpace>,
    sram: Arc<RamStore>,
    peripherals: Arc<RamStore>,
    pub(super) now: Cycles,
}

impl Pair {
    /// Both, with the same contents of the flash memory, after the reset sequence.
    pub(super) fn new(flash: Vec<u8>) -> Self {
        let space = AddressSpace::new("both", 32);
        let (sram, peripherals) = (Arc::new(RamStore::new(SRAM_SIZE as u64)), Arc::new(RamStore::new(SIZE as u64)));
        {
            let mut topology = space.topology();
            let rom = Arc::new(RomStore::new(flash.clone()));
            for base in [0, FLASH] {
                topology.map(Region::rom("flash", rom.clone(), RomWrite::Fault), base.into()).unwrap();
            }
            topology.map(Region::ram("SRAM", sram.clone()), SRAM.into()).unwrap();
            topology.map(Region::ram("CCM", Arc::new(RamStore::new(0x1_0000))), CCM.into()).unwrap();
            topology.map(Region::ram("peripherals", peripherals.clone()), PERIPHERALS.into()).unwrap();
        }
        let space = Arc::new(space);
        let (cpu, library) = (Cpu::new(flash), library(&space));
        let mut pair = Self { cpu, bus: Peripherals::new(), library, space, sram, peripherals, now: 0 };
        pair.fill(&vec![0; SRAM_SIZE]);
        pair.reset();
        pair
    }

    /// Resets both, up to the first instruction.
    pub(super) fn reset(&mut self) {
        self.library = library(&self.space);
        self.cpu.reset();
        self.cpu.core.refused = None;
        self.bus.missed = false;
        self.step("reset");
    }

    /// Fills RAM.
    pub(super) fn fill(&mut self, bytes: &[u8]) {
        self.cpu.sram().write(SRAM, bytes).unwrap();
        self.sram.write_at(0, bytes).unwrap();
    }

    /// Sets all registers of both.
    pub(super) fn set(&mut self, regs: Regs) {
        self.library.set_regs(regs);
        let registers = &mut self.cpu.core.registers;
        *registers = Registers::new();
        for register in 0..16 {
            registers.set(register, regs.r[usize::from(register)]);
        }
        registers.set_xpsr(regs.xpsr);
        registers.primask = regs.primask;
        registers.faultmask = regs.faultmask;
        registers.basepri = regs.basepri;
        registers.control = regs.control;
        registers.choose_stack();
        *registers.stack(false) = regs.msp;
        *registers.stack(true) = regs.psp;
        self.cpu.core.attention = true;
    }

    /// Changes the system control space of both.
    pub(super) fn change(&mut self, change: impl Fn(&mut Sys)) {
        self.library.with_sys(&change);
        change(&mut self.cpu.core.sys);
        self.cpu.core.attention = true;
    }

    /// Lets both do a step, and compares them. None if ours refuses it, or something has been accessed that the other
    /// does not have in its place.
    pub(super) fn step(&mut self, what: &str) -> Option<()> {
        let before = self.library.regs();
        let used = self.cpu.step(&mut self.bus, self.now);
        self.now += used;
        let theirs = self.library.step();
        if self.bus.missed || self.cpu.core.refused.is_some() {
            return None;
        }
        self.keep_block(&before, what);
        let surplus = self.surplus(&before);
        self.cpu.core.unticked += surplus;
        self.cpu.core.tick();
        assert_eq!(self.ours(), self.theirs(), "{what}, with {before:x?}");
        assert_eq!(used + surplus, theirs, "cycles of {what}, with {before:x?}");
        Some(())
    }

    /// Cycles that the library charges too much: an entry takes twelve and the time of eight accesses there, a return
    /// ten and that.
    fn surplus(&self, before: &Regs) -> Cycles {
        let (left, entered) = (before.exception(), self.cpu.core.entered);
        // The handler of one begins where that of the other, or its own, ends.
        let chained = before.in_handler() && (left.0 == entered || !self.cpu.core.sys.is_active(left));
        match entered {
            0 if self.library.current_exception() != left => 6,
            0 => 0,
            _ if chained => 0,
            _ => 8,
        }
    }

    /// The library saves no state of an IT block at an exception, and the rest of the block would be executed whatever
    /// its condition says (DDI 0403 B1.5.6). An instruction that has called an exception is over.
    fn keep_block(&mut self, before: &Regs, what: &str) {
        let entered =
            self.cpu.core.entered != 0 && self.library.reg(LR) >= exc_return::HANDLER_MSP & !exc_return::FP_FRAME;
        if before.xpsr & xpsr::IT_MASK == 0 || !entered {
            return;
        }
        let process = self.library.reg(LR) & 1 << 2 != 0;
        let place = SAVED_XPSR + if process { self.library.psp() } else { self.library.msp() };
        // The stack may lie anywhere.
        let Some(ours) = self.cpu.sram().word(place).map(|saved| saved & xpsr::IT_MASK) else { return };
        let mut advanced = Registers::new();
        advanced.set_xpsr(before.xpsr);
        advanced.advance_block();
        let over = self.cpu.sram().word(place - 4).is_some_and(|back| back != before.r[15]);
        let expected = if over { advanced.xpsr() } else { before.xpsr } & xpsr::IT_MASK;
        assert_eq!(ours, expected, "state of the IT block at {what}, with {before:x?}");
        let mut saved = [0; 4];
        if self.sram.read_at((place - SRAM).into(), &mut saved).is_ok() {
            let saved = u32::from_le_bytes(saved) | ours;
            self.sram.write_at((place - SRAM).into(), &saved.to_le_bytes()).unwrap();
        }
    }

    fn ours(&mut self) -> State {
        let mut registers = self.cpu.core.registers;
        let (msp, psp) = (*registers.stack(false), *registers.stack(true));
        let r = std::array::from_fn(|register| registers.get(register as u8));
        let masks = (registers.primask, registers.faultmask, registers.basepri, registers.control);
        let flow = (self.cpu.core.asleep, self.cpu.core.locked_up);
        let memory = near(registers.get(SP), |place| self.cpu.sram().word(place));
        State { r, msp, psp, xpsr: registers.xpsr(), masks, flow, sys: control(&self.cpu.core.sys), memory }
    }

    fn theirs(&self) -> State {
        let Regs { r, msp, psp, xpsr, primask, faultmask, basepri, control: kept, .. } = self.library.regs();
        let memory = near(r[usize::from(SP)], |place| {
            let mut word = [0; 4];
            self.sram.read_at(place.checked_sub(SRAM)?.into(), &mut word).ok()?;
            Some(u32::from_le_bytes(word))
        });
        // The bit that says that floating point has been used is not kept here.
        let masks = (primask, faultmask, basepri, kept & 0b11);
        let flow = (self.library.is_asleep(), self.library.is_locked_up());
        State { r, msp, psp, xpsr, masks, flow, sys: self.library.with_sys(|sys| control(sys)), memory }
    }

    /// Compares the whole RAM and the memory in the place of peripherals.
    pub(super) fn compare_memory(&self, what: &str) {
        let (mut ours, mut theirs) = (vec![0; SRAM_SIZE], vec![0; SRAM_SIZE]);
        self.cpu.sram().read(SRAM, &mut ours).unwrap();
        self.sram.read_at(0, &mut theirs).unwrap();
        let other = ours.iter().zip(&theirs).position(|(a, b)| a != b);
        assert_eq!(other, None, "RAM after {what}");
        let mut theirs = vec![0; SIZE];
        self.peripherals.read_at(0, &mut theirs).unwrap();
        assert_eq!(self.bus.ram, theirs, "peripherals after {what}");
    }

    /// Makes the memory in the place of peripherals, and RAM, the same again.
    pub(super) fn level(&mut self) {
        let mut bytes = vec![0; SRAM_SIZE];
        self.sram.read_at(0, &mut bytes).unwrap();
        self.cpu.sram().write(SRAM, &bytes).unwrap();
        self.peripherals.read_at(0, &mut self.bus.ram).unwrap();
    }
}

/// The state that both cores have.
#[derive(Debug, PartialEq)]
struct State {
    r: [u32; 16],
    msp: u32,
    psp: u32,
    xpsr: u32,
    masks: (bool, bool, u8, u32),
    /// Asleep, locked up.
    flow: (bool, bool),
    sys: Vec<u32>,
    /// The words at the stack pointer.
    memory: Vec<Option<u32>>,
}

fn near(stack: u32, read: impl Fn(u32) -> Option<u32>) -> Vec<Option<u32>> {
    (0..8).map(|word| read(stack.wrapping_add(4 * word))).collect()
}

/// The state of a system control space.
fn control(sys: &Sys) -> Vec<u32> {
    let mut words = vec![
        sys.vtor,
        sys.prigroup.into(),
        sys.scr,
        sys.ccr,
        sys.shcsr,
        sys.cfsr,
        sys.hfsr,
        sys.bfar,
        sys.reset_requested.into(),
        sys.syst_csr,
        sys.syst_rvr,
        sys.syst_cvr,
        sys.demcr,
        sys.dwt_cyccnt,
    ];
    words.extend([sys.enable, sys.pending, sys.active].concat());
    words.extend(sys.priority.map(u32::from));
    words
}

fn library(space: &Arc<AddressSpace>) -> ArmV7m {
    let config = Config::CORTEX_M4F.with_priority_bits(PRIORITY_BITS).with_bit_band(false);
    let core = ArmV7m::new(config);
    core.attach_space(space.clone());
    core
}
