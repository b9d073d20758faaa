//! The core: a Cortex-M4 with its interrupt controller and system timer, and the memories it executes from.
//!
//! The only file that knows the library that emulates it. Everything else sees [`Cpu`] and the [`Bus`] that the
//! core's accesses to peripherals arrive at.

use std::fmt;
use std::sync::Arc;

use rsemu::core::space::{
    AddressSpace, DispatchPolicy, Mapping, MappingId, MemAttrs, MemOps, MemResult, RamStore, Region, RomStore, RomWrite,
};
use rsemu::core::value::Width;
use rsemu::cpu::arm::v7m::sys::Exception;
use rsemu::cpu::arm::v7m::{ArmV7m, Config, Regs};

use super::peripheral::Cycles;
use super::step::{LINES, View};
use super::stop::Stop;
use crate::board::Chip;

/// Where the memories are (RM0090 2.3).
const FLASH: u32 = 0x0800_0000;
const SRAM: u32 = 0x2000_0000;
const CCM: u32 = 0x1000_0000;
/// Signature of the device: identity, flash size (RM0090 39).
const SIGNATURE: u32 = 0x1FFF_7A00;
/// Peripherals, and the vendor's part of the core's own bus.
const PERIPHERALS: [(u32, u64); 2] = [(0x4000_0000, 0x2000_0000), (0xE004_2000, 0x400)];

/// Bytes of flash memory.
pub(super) const FLASH_SIZE: usize = 0x10_0000;
/// Bytes of SRAM1 and SRAM2.
pub(super) const SRAM_SIZE: usize = 0x2_0000;
const CCM_SIZE: u64 = 0x1_0000;

/// Bits of the priority of an interrupt.
const PRIORITY_BITS: u8 = 4;
/// What memory holds after power-on, so that the part of the stack that was never used can be told.
const PAINT: u8 = 0xA5;

/// A table finds memories faster than a search.
const DISPATCH: DispatchPolicy = DispatchPolicy::Dense { page_bits: 16, cover: 1 << 32 };

/// ITSTATE and the number of the exception in xPSR (DDI 0403 B1.4.2).
const IT_STATE: u32 = 0x0600_FC00;
const EXCEPTION: u32 = 0x1FF;
/// The link register. In a handler it holds no address, but how to return; bit 2 says which stack the frame is on.
const LR: u8 = 14;
const EXC_RETURN: u32 = 0xFFFF_FF00;
const ON_PROCESS_STACK: u32 = 1 << 2;
/// Where in the frame of an exception xPSR is.
const SAVED_XPSR: u32 = 28;

/// Control bits of SysTick: counts, interrupts.
const SYSTICK_ON: u32 = 0b11;

/// Takes the core's accesses to peripherals.
pub(super) trait Bus: fmt::Debug + Send + Sync {
    /// Reads 1, 2 or 4 bytes.
    fn read(&self, address: u32, bytes: usize) -> u32;
    /// Writes 1, 2 or 4 bytes.
    fn write(&self, address: u32, bytes: usize, value: u32);
}

/// A window of addresses that lead to the bus.
#[derive(Debug)]
struct Window {
    base: u32,
    bus: Arc<dyn Bus>,
}

impl MemOps for Window {
    fn read(&self, offset: u64, to: &mut [u8], _: MemAttrs) -> MemResult {
        let value = self.bus.read(self.base + offset as u32, to.len());
        for (to, byte) in to.iter_mut().zip(value.to_le_bytes()) {
            *to = byte;
        }
        Ok(())
    }

    fn write(&self, offset: u64, from: &[u8], _: MemAttrs) -> MemResult {
        let value = from.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte));
        self.bus.write(self.base + offset as u32, from.len(), value);
        Ok(())
    }
}

/// SRAM as the DMA controllers and a debug probe see it. Clones are the same memory.
#[derive(Clone, Debug)]
pub(super) struct Sram(Arc<RamStore>);

impl Sram {
    /// Memory after power-on.
    pub(super) fn new() -> Self {
        let sram = Self(Arc::new(RamStore::new(SRAM_SIZE as u64)));
        sram.forget();
        sram
    }

    /// Reads bytes; none if they are not all there.
    pub(super) fn read(&self, address: u32, to: &mut [u8]) -> Option<()> {
        self.0.read_at(address.checked_sub(SRAM)?.into(), to).ok()
    }

    /// Writes bytes; none if they are not all there.
    pub(super) fn write(&self, address: u32, from: &[u8]) -> Option<()> {
        self.0.write_at(address.checked_sub(SRAM)?.into(), from).ok()
    }

    /// Reads a word.
    pub(super) fn word(&self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        self.read(address, &mut bytes)?;
        Some(u32::from_le_bytes(bytes))
    }

    /// What power-off leaves of the contents: nothing.
    pub(super) fn forget(&self) {
        let _ = self.0.fill(0, SRAM_SIZE as u64, PAINT);
    }

    /// How many bytes at the end of a part of memory have been written since power-on.
    pub(super) fn used_in(&self, part: core::ops::Range<u32>) -> u32 {
        let paint = u32::from_le_bytes([PAINT; 4]);
        let end = part.end;
        let untouched = (part.start.next_multiple_of(4)..end).step_by(4).find(|&at| self.word(at) != Some(paint));
        untouched.map_or(0, |at| end - at)
    }
}

/// What decides how a program goes on, as far as registers tell.
pub(super) type Registers = Regs;

/// The core with its memories. From outside it is to be seen and changed as with a debug probe.
#[derive(Debug)]
pub struct Cpu {
    core: ArmV7m,
    space: Arc<AddressSpace>,
    sram: Sram,
    flash: Arc<RomStore>,
    /// Where the flash memory is to be seen.
    places: Vec<(MappingId, u32)>,
}

impl Cpu {
    /// A core that has just been reset, with `flash` as the contents of the flash memory.
    pub(super) fn new(flash: Vec<u8>, bus: &Arc<dyn Bus>) -> Result<Self, Stop> {
        let flash = Arc::new(RomStore::new(flash));
        let sram = Sram::new();
        let mut places = Vec::new();
        let space = AddressSpace::new("bus matrix", 32).with_dispatch(DISPATCH);
        {
            let mut topology = space.topology();
            let mut map =
                |region, base: u32| topology.map(region, base.into()).map_err(|error| Stop::Image(error.to_string()));
            // The boot pins select flash: it is at address 0, too.
            for base in [0, FLASH] {
                places.push((map(rom("flash", &flash), base)?, base));
            }
            map(rom("signature", &Arc::new(RomStore::new(signature()))), SIGNATURE)?;
            map(Region::ram("SRAM", sram.0.clone()), SRAM)?;
            map(Region::ram("CCM", Arc::new(RamStore::new(CCM_SIZE))), CCM)?;
            for (base, length) in PERIPHERALS {
                map(Region::io("peripherals", length, Arc::new(Window { base, bus: bus.clone() })), base)?;
            }
        }
        let space = Arc::new(space);
        Ok(Self { core: core(&space), space, sram, flash, places })
    }

    /// The memory that DMA can reach.
    pub(super) fn sram(&self) -> &Sram {
        &self.sram
    }

    /// Starts anew, from the reset vector.
    pub(super) fn reset(&mut self) {
        // The core of the library keeps its interrupt enables over a reset: a fresh one does not.
        self.core = core(&self.space);
    }

    /// Executes an instruction, or enters an exception. Gives the cycles that takes.
    pub(super) fn step(&self) -> Cycles {
        let before = self.core.xpsr();
        let used = self.core.step();
        if before & IT_STATE != 0 {
            self.keep_it_state(before);
        }
        used
    }

    /// An exception that comes within an IT block has its state in the xPSR that it saves (DDI 0403 B1.5.6). The library
    /// leaves it out, and the rest of the block would be executed whatever its condition says.
    fn keep_it_state(&self, before: u32) {
        let link = self.core.reg(LR);
        let entered = (before ^ self.core.xpsr()) & EXCEPTION != 0 && link >= EXC_RETURN;
        if !entered {
            return;
        }
        let frame = if link & ON_PROCESS_STACK != 0 { self.core.psp() } else { self.core.msp() };
        let place = frame + SAVED_XPSR;
        if let Some(saved) = self.sram.word(place) {
            // Where it was read it can be written.
            let _ = self.sram.write(place, &(saved | before & IT_STATE).to_le_bytes());
        }
    }

    /// Whether the core waits for an interrupt or an event.
    pub fn is_asleep(&self) -> bool {
        self.core.is_asleep()
    }

    /// Whether it is stuck in faults.
    pub(super) fn is_locked_up(&self) -> bool {
        self.core.is_locked_up()
    }

    /// Whether the program has asked for a reset.
    pub(super) fn wants_reset(&self) -> bool {
        self.core.reset_requested()
    }

    /// Where the program stands.
    pub fn pc(&self) -> u32 {
        self.core.pc()
    }

    /// All registers.
    pub(super) fn registers(&self) -> Registers {
        self.core.regs()
    }

    /// What an observer sees of it, and of the bus.
    pub(super) fn view(&self, bus: (Option<Chip>, bool)) -> View {
        let registers = self.core.regs();
        let [.., pc] = registers.r;
        let (enabled, pending, active) = self.core.with_sys(|sys| {
            let active = std::array::from_fn(|word| sys.active[word]);
            (lines(&sys.enable), lines(&sys.pending), active)
        });
        let Exception(exception) = registers.exception();
        View { pc, exception, masked: registers.primask, enabled, pending, active, bus }
    }

    /// Where the handler of an exception begins.
    pub(super) fn handler(&self, exception: u16) -> Option<u32> {
        // The lowest bit tells that it is Thumb code.
        Some(self.peek(self.core.vtor() + 4 * u32::from(exception))? & !1)
    }

    /// The level of an interrupt line.
    pub(super) fn set_interrupt(&self, number: u16, level: bool) {
        self.core.set_irq(number, level);
    }

    /// The interrupt that cannot be masked.
    pub(super) fn raise_nmi(&self) {
        self.core.with_sys(|sys| sys.set_pending(Exception::NMI, true));
    }

    /// Lets at most `span` cycles pass without executing anything, fewer if the system timer wants attention
    /// before. Gives how many have passed.
    pub(super) fn idle(&self, span: Cycles) -> Cycles {
        self.core.with_sys(|sys| {
            let ticking = sys.syst_csr & SYSTICK_ON == SYSTICK_ON;
            let span = if ticking { span.min(Cycles::from(sys.syst_cvr).max(1)) } else { span };
            sys.tick_cyccnt(span);
            if sys.tick_systick(span) && ticking {
                sys.set_pending(Exception::SYSTICK, true);
            }
            span
        })
    }

    /// Programs the flash memory from `address` on. Gives what was there; none if it is not all flash memory.
    pub fn program(&mut self, address: u32, bytes: &[u8]) -> Option<Vec<u8>> {
        let start = address.checked_sub(FLASH)? as usize;
        let mut contents = self.flash.as_bytes().to_vec();
        let cells = contents.get_mut(start..start.checked_add(bytes.len())?)?;
        let before = cells.to_vec();
        cells.copy_from_slice(bytes);
        self.flash = Arc::new(RomStore::new(contents));
        let mut topology = self.space.topology();
        for (place, base) in &self.places {
            topology.replace(*place, Mapping::new(rom("flash", &self.flash), (*base).into())).ok()?;
        }
        Some(before)
    }

    /// Puts another word at `address` in RAM, as a disturbance does. Gives what was there; none where there is no RAM.
    pub fn disturb(&mut self, address: u32, word: u32) -> Option<u32> {
        let before = self.sram.word(address)?;
        self.sram.write(address, &word.to_le_bytes())?;
        Some(before)
    }

    /// The word at `address` in memory; none where there is no memory.
    pub fn peek(&self, address: u32) -> Option<u32> {
        self.space.read(address.into(), Width::U32, MemAttrs::DEBUG).ok().map(|word| word as u32)
    }
}

/// The interrupts in a set of exceptions, of which the first 16 are the core's own.
fn lines<const WORDS: usize>(set: &[u32; WORDS]) -> [u32; LINES] {
    std::array::from_fn(|word| set[word] >> 16 | set[word + 1] << 16)
}

fn core(space: &Arc<AddressSpace>) -> ArmV7m {
    let core = ArmV7m::new(Config::CORTEX_M4F.with_priority_bits(PRIORITY_BITS));
    core.attach_space(space.clone());
    core
}

fn rom(name: &str, store: &Arc<RomStore>) -> Region {
    Region::rom(name, store.clone(), RomWrite::Fault)
}

/// 0x1FFF_7A10: a 96-bit identity; 0x1FFF_7A22: the flash memory's size in KiB.
fn signature() -> Vec<u8> {
    let mut bytes = vec![0xFF; 0x30];
    let words = [0x0026_0038, 0x3433_510D, 0x3931_3234_u32];
    for (place, word) in words.into_iter().enumerate() {
        bytes[0x10 + 4 * place..][..4].copy_from_slice(&word.to_le_bytes());
    }
    bytes[0x22..0x24].copy_from_slice(&((FLASH_SIZE / 1024) as u16).to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Peripherals of which there are none.
    #[derive(Debug)]
    struct Nothing;

    impl Bus for Nothing {
        fn read(&self, _: u32, _: usize) -> u32 {
            0
        }

        fn write(&self, _: u32, _: usize, _: u32) {}
    }

    #[test]
    fn an_it_block_goes_on_after_an_exception_within_it() {
        let mut flash = vec![0; FLASH_SIZE];
        let words = |at: usize, words: &[u32], flash: &mut [u8]| {
            for (place, word) in flash[at..].chunks_exact_mut(4).zip(words) {
                place.copy_from_slice(&word.to_le_bytes());
            }
        };
        // Stack and reset vector; PendSV.
        words(0, &[SRAM + 0x1000, FLASH + 0x41], &mut flash);
        words(14 * 4, &[FLASH + 0x51], &mut flash);
        // MOVS R0, #0; CMP R0, #1; ITT EQ; ADDEQ R1, #1 twice; B .
        words(0x40, &[0x2801_2000, 0x3101_BF04, 0xE7FE_3101], &mut flash);
        // BX LR
        words(0x50, &[0x4770], &mut flash);
        let bus: Arc<dyn Bus> = Arc::new(Nothing);
        let cpu = Cpu::new(flash, &bus).unwrap();
        while cpu.pc() != FLASH + 0x46 {
            cpu.step();
        }
        cpu.core.set_reg(1, 0);
        cpu.core.with_sys(|sys| sys.set_pending(Exception::PEND_SV, true));
        let mut handled = false;
        while cpu.pc() != FLASH + 0x4A {
            cpu.step();
            handled |= cpu.pc() == FLASH + 0x50;
        }
        assert!(handled);
        assert_eq!(cpu.core.reg(1), 0, "0 is not 1: neither is executed");
    }
}
