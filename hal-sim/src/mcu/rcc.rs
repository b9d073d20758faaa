//! RCC: oscillators, PLL, prescalers, clock enables and resets (RM0090 7.3).
//!
//! The board's crystal has 16 MHz. Oscillators and PLL take their time to become ready. What depends on the
//! clocks asks [`Rcc::clocks`] after a write.

use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal, bit, field};
use super::unit::{Group, PeripheralName};
use crate::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};

const CR: u32 = 0x00;
const PLLCFGR: u32 = 0x04;
const CFGR: u32 = 0x08;
const CIR: u32 = 0x0C;
const BDCR: u32 = 0x70;
const CSR: u32 = 0x74;
const DCKCFGR: u32 = 0x8C;

const HSEON: u32 = 16;
const CSSON: u32 = 19;
const PLLON: u32 = 24;
const PLLI2SON: u32 = 26;
/// HSION, HSITRIM, HSEON, HSEBYP, CSSON, PLLON.
const CR_WRITABLE: u32 = 0x010D_00F9;
const CR_RESET: u32 = 0x81;
/// BDRST, RTCEN, RTCSEL: the real-time clock itself is not there.
const BDCR_MODELLED: u32 = 1 << 16 | 1 << 15 | 3 << 8;
const RMVF: u32 = 1 << 24;
const LSION: u32 = 0;

/// The crystal.
const HSE_HZ: u64 = 16_000_000;
/// The oscillator inside.
const HSI_HZ: u64 = 16_000_000;
/// The slow oscillator of the watchdog.
const LSI_HZ: u64 = 32_000;
/// The highest clocks (table 17 of the datasheet).
const SYSCLK_MAX: u64 = 168_000_000;
const APB1_MAX: u64 = 42_000_000;
const APB2_MAX: u64 = 84_000_000;
/// Start-up times of the datasheet: HSI, HSE (typical), PLL, LSI.
const HSI_START: Nanos = 2 * MICROSECOND;
const HSE_START: Nanos = 2 * MILLISECOND;
const PLL_START: Nanos = 200 * MICROSECOND;
const LSI_START: Nanos = 40 * MICROSECOND;

/// Why the chip was last reset: bits of CSR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// Switched on.
    Power = 0x0E00_0000,
    /// By the independent watchdog.
    Watchdog = 0x2400_0000,
    /// By the program, through the NRST pin as all inner resets.
    Software = 0x1400_0000,
}

/// The clocks in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Clocks {
    /// The core clock in Hz.
    pub(super) hz: u64,
    /// Core cycles in a period of the clocks of APB1 and APB2.
    pub(super) apb: [Cycles; 2],
    /// The frequency that MCO1 puts out, in Hz.
    pub(super) mco1: u64,
}

impl Clocks {
    /// Core cycles in a period of the clock of `unit`. Timers on a bus that is divided run at twice its clock.
    pub(super) fn divider(&self, unit: PeripheralName) -> Cycles {
        if unit == PeripheralName::Iwdg {
            return (self.hz / LSI_HZ).max(1);
        }
        let apb = match unit.description().group {
            Group::Apb1 => self.apb[0],
            Group::Apb2 => self.apb[1],
            Group::Ahb1 | Group::Ahb2 | Group::Always => return 1,
        };
        match unit {
            PeripheralName::Tim2 | PeripheralName::Tim3 | PeripheralName::Tim4 | PeripheralName::Tim5 => {
                (apb / 2).max(1)
            }
            _ => apb,
        }
    }
}

/// Enables and resets of the peripherals on a bus.
#[derive(Debug, Default)]
struct Gates {
    reset: u32,
    enable: u32,
    low_power: u32,
}

/// The reset and clock controller.
#[derive(Debug)]
pub(super) struct Rcc {
    now: Cycles,
    /// The core clock, to know how long start-up times are.
    hz: u64,
    cr: u32,
    pllcfgr: u32,
    cfgr: u32,
    bdcr: u32,
    csr: u32,
    /// The source that is in use: SWS.
    source: u32,
    /// When HSI, HSE, PLL and LSI are ready; never while they are off.
    ready: [Cycles; 4],
    /// AHB1, AHB2, AHB3, APB1, APB2.
    gates: [Gates; 5],
    /// Resets that have been asked for: the bus, the bits.
    resets: Option<(Group, u32)>,
    /// The crystal swings when it is switched on.
    crystal: bool,
}

const HSI: usize = 0;
const HSE: usize = 1;
const PLL: usize = 2;
const LSI: usize = 3;

const AHB1: usize = 0;
const AHB2: usize = 1;
const APB1: usize = 3;
const APB2: usize = 4;

impl Rcc {
    /// As after a reset at `now` for that cause, running on HSI. `flags` are those of earlier resets.
    pub(super) fn new(now: Cycles, cause: Cause, flags: u32) -> Self {
        let mut rcc = Self {
            now,
            hz: HSI_HZ,
            cr: CR_RESET,
            pllcfgr: 0x2400_3010,
            cfgr: 0,
            bdcr: 0,
            csr: flags & 0xFE00_0000 | cause as u32,
            source: 0,
            ready: [now, NEVER, NEVER, NEVER],
            gates: Default::default(),
            resets: None,
            crystal: true,
        };
        rcc.gates[AHB1].enable = 0x0010_0000;
        rcc
    }

    /// The same after a reset.
    pub(super) fn restarted(&self, now: Cycles, cause: Cause) -> Self {
        let flags = if cause == Cause::Power { 0 } else { self.csr };
        Self { crystal: self.crystal, ..Self::new(now, cause, flags) }
    }

    /// Whether the clock of `unit` is on.
    pub(super) fn is_enabled(&self, unit: PeripheralName) -> bool {
        let description = unit.description();
        let gates = match description.group {
            Group::Ahb1 => &self.gates[AHB1],
            Group::Ahb2 => &self.gates[AHB2],
            Group::Apb1 => &self.gates[APB1],
            Group::Apb2 => &self.gates[APB2],
            Group::Always => return true,
        };
        bit(gates.enable, description.bit) && !bit(gates.reset, description.bit)
    }

    /// The peripherals that the last write has reset: their bus, their bits.
    pub(super) fn take_resets(&mut self) -> Option<(Group, u32)> {
        self.resets.take()
    }

    /// Lets the crystal stop, or swing again when it is switched on. What runs on it goes on with HSI, if the clock
    /// security system looks after it: true if that has found it stopped, which is an NMI (RM0090 7.2.7).
    pub(super) fn set_crystal(&mut self, swings: bool) -> Result<bool, &'static str> {
        let lost = self.crystal && !swings && self.is_ready(HSE);
        self.crystal = swings;
        if !lost {
            return Ok(false);
        }
        if !bit(self.cr, CSSON) {
            return Err("the crystal has stopped, and the clock security system is off");
        }
        self.cr &= !(1 << HSEON | 1 << PLLON);
        (self.ready[HSE], self.ready[PLL]) = (NEVER, NEVER);
        self.cfgr &= !3;
        self.source = 0;
        Ok(true)
    }

    /// The clocks in force.
    pub(super) fn clocks(&self) -> Clocks {
        let sysclk = match self.source {
            0 => HSI_HZ,
            1 => HSE_HZ,
            _ => self.pll_hz(),
        };
        let hpre = field(self.cfgr, 4, 4);
        let hz = match hpre {
            0..8 => sysclk,
            8..12 => sysclk >> (hpre - 7),
            _ => sysclk >> (hpre - 6),
        };
        let apb = [10, 13].map(|low| match field(self.cfgr, low, 3) {
            0..4 => 1,
            n => 2 << (n - 4),
        });
        Clocks { hz: hz.max(1), apb, mco1: self.mco1_hz() }
    }

    fn mco1_hz(&self) -> u64 {
        let source = match field(self.cfgr, 21, 2) {
            0 if self.is_ready(HSI) => HSI_HZ,
            2 if self.is_ready(HSE) => HSE_HZ,
            3 if self.is_ready(PLL) => self.pll_hz(),
            _ => 0,
        };
        match field(self.cfgr, 24, 3) {
            0..4 => source,
            n => source / u64::from(n - 2),
        }
    }

    fn pll_hz(&self) -> u64 {
        let input = if bit(self.pllcfgr, 22) { HSE_HZ } else { HSI_HZ };
        let [m, n, p] = [(0, 6), (6, 9), (16, 2)].map(|(low, width)| u64::from(field(self.pllcfgr, low, width)));
        input / m.max(1) * n / (2 * (p + 1))
    }

    fn is_ready(&self, oscillator: usize) -> bool {
        self.ready[oscillator] <= self.now
    }

    /// Switches an oscillator on or off.
    fn switch(&mut self, oscillator: usize, on: bool, start: Nanos) {
        let ready = &mut self.ready[oscillator];
        if !on {
            *ready = NEVER;
        } else if *ready == NEVER {
            *ready = self.now + (start * self.hz).div_ceil(SECOND);
        }
    }

    /// Switches to the source that SW asks for, once it is ready.
    fn select(&mut self) {
        let wanted = field(self.cfgr, 0, 2);
        if [HSI, HSE, PLL].get(wanted as usize).is_some_and(|&oscillator| self.is_ready(oscillator)) {
            self.source = wanted;
        }
    }

    fn check(&self) -> Access {
        let Clocks { hz, apb, .. } = self.clocks();
        if self.source == 2 {
            let vco = self.pll_hz() * u64::from(2 * (field(self.pllcfgr, 16, 2) + 1));
            if !(100_000_000..=432_000_000).contains(&vco) {
                return Err(Refusal::Use(
                    "the PLL's oscillator is out of its range, with a crystal of HSE_HZ in hal-sim/src/mcu/rcc.rs",
                ));
            }
        }
        if hz > SYSCLK_MAX || hz / apb[0] > APB1_MAX || hz / apb[1] > APB2_MAX {
            return Err(Refusal::Use("a clock is too fast for the chip"));
        }
        Ok(())
    }

    /// The register of a group of gates at `offset`: which one of reset, enable and low-power it is.
    fn gate(offset: u32) -> Option<(usize, u32)> {
        let (kind, offset) = match offset {
            0x10..0x28 => (0, offset - 0x10),
            0x30..0x48 => (1, offset - 0x30),
            0x50..0x68 => (2, offset - 0x50),
            _ => return None,
        };
        let group = match offset {
            0x00 => AHB1,
            0x04 => AHB2,
            0x08 => 2,
            0x10 => APB1,
            0x14 => APB2,
            _ => return None,
        };
        Some((group, kind))
    }
}

impl Peripheral for Rcc {
    fn read(&mut self, offset: u32) -> Access<u32> {
        let flag = |oscillator: usize, bit: u32| u32::from(self.is_ready(oscillator)) << bit;
        match offset {
            CR => Ok(self.cr | flag(HSI, 1) | flag(HSE, 17) | flag(PLL, 25)),
            PLLCFGR => Ok(self.pllcfgr),
            CFGR => Ok(self.cfgr & !0xC | self.source << 2),
            CIR | DCKCFGR => Ok(0),
            BDCR => Ok(self.bdcr),
            CSR => Ok(self.csr | flag(LSI, 1)),
            _ => {
                let (group, kind) = Self::gate(offset).ok_or(Refusal::Register)?;
                let gates = &self.gates[group];
                Ok([gates.reset, gates.enable, gates.low_power][kind as usize])
            }
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            CR if bit(value, PLLI2SON) => return Err(Refusal::Use("the audio PLL is not modelled")),
            CR => {
                self.cr = value & CR_WRITABLE;
                self.switch(HSI, bit(value, 0) || self.source == 0, HSI_START);
                // Ready for good once it swings; the PLL can be on before.
                self.switch(HSE, bit(value, HSEON) && self.crystal, HSE_START);
                self.switch(PLL, bit(value, PLLON), PLL_START);
            }
            PLLCFGR if bit(self.cr, PLLON) => return Err(Refusal::Use("PLLCFGR is changed while the PLL is on")),
            PLLCFGR => self.pllcfgr = value,
            CFGR => {
                self.cfgr = value;
                self.select();
                self.check()?;
            }
            // Relatives of the chip have it; drivers clear it.
            DCKCFGR if value == 0 => {}
            CIR if value & 0x7F00 == 0 => {}
            CIR => return Err(Refusal::Use("interrupts of oscillators are not modelled")),
            BDCR if value & BDCR_MODELLED == value => self.bdcr = value,
            BDCR => return Err(Refusal::Use("the 32 kHz crystal is not modelled")),
            CSR => {
                if value & RMVF != 0 {
                    self.csr = 0;
                }
                self.csr = self.csr & !1 | value & 1;
                self.switch(LSI, bit(value, LSION), LSI_START);
            }
            _ => {
                let (group, kind) = Self::gate(offset).ok_or(Refusal::Register)?;
                let gates = &mut self.gates[group];
                match kind {
                    0 => {
                        let fresh = value & !gates.reset;
                        gates.reset = value;
                        // On AHB3 there is nothing that is modelled.
                        let groups = [Some(Group::Ahb1), Some(Group::Ahb2), None, Some(Group::Apb1), Some(Group::Apb2)];
                        self.resets = groups[group].map(|group| (group, fresh));
                    }
                    1 => gates.enable = value,
                    _ => gates.low_power = value,
                }
            }
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
        self.select();
    }

    fn next_event(&self) -> Cycles {
        self.ready.into_iter().filter(|&at| at > self.now).min().unwrap_or(NEVER)
    }

    fn set_divider(&mut self, _divider: Cycles) {
        self.hz = self.clocks().hz;
    }

    fn reset(&mut self) {
        *self = self.restarted(self.now, Cause::Software);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first divider of the PLL, which makes 2 MHz of the crystal.
    const OF_CRYSTAL: u32 = (HSE_HZ / 2_000_000) as u32;

    #[test]
    fn the_pll_makes_168_mhz_of_the_crystal_when_it_is_ready() {
        let mut rcc = Rcc::new(0, Cause::Power, 0);
        assert_eq!(rcc.clocks().hz, 16_000_000);
        rcc.write(PLLCFGR, OF_CRYSTAL | 168 << 6 | 1 << 22 | 7 << 24).unwrap();
        rcc.write(CR, CR_RESET | 1 << HSEON | 1 << PLLON).unwrap();
        assert_eq!(rcc.next_event(), 3_200);
        rcc.write(CFGR, 5 << 10 | 4 << 13 | 2).unwrap();
        assert_eq!((rcc.clocks().hz, rcc.read(CFGR).unwrap() & 0xC), (16_000_000, 0));
        rcc.advance(32_000);
        assert_eq!(rcc.read(CR).unwrap() >> 16 & 0x202, 0x202);
        let clocks = rcc.clocks();
        assert_eq!(clocks, Clocks { hz: 168_000_000, apb: [4, 2], mco1: 16_000_000 });
        assert_eq!(
            (
                clocks.divider(PeripheralName::Usart3),
                clocks.divider(PeripheralName::Tim5),
                clocks.divider(PeripheralName::Spi1)
            ),
            (4, 2, 2)
        );
        rcc.write(CR, 1 << HSEON | 1 << PLLON).unwrap();
        assert_eq!(rcc.clocks().mco1, 0, "MCO1 has HSI, which is off");
    }

    #[test]
    fn a_crystal_that_stops_leaves_the_core_on_hsi() {
        let mut rcc = Rcc::new(0, Cause::Power, 0);
        rcc.write(PLLCFGR, OF_CRYSTAL | 168 << 6 | 1 << 22 | 7 << 24).unwrap();
        rcc.write(CR, CR_RESET | 1 << HSEON | 1 << PLLON).unwrap();
        rcc.write(CFGR, 5 << 10 | 4 << 13 | 2).unwrap();
        rcc.advance(32_000);
        assert!(rcc.set_crystal(false).is_err(), "nobody looks after it");
        assert_eq!(rcc.set_crystal(true), Ok(false));
        rcc.write(CR, CR_RESET | 1 << HSEON | 1 << PLLON | 1 << CSSON).unwrap();
        assert_eq!((rcc.set_crystal(false), rcc.clocks().hz), (Ok(true), 16_000_000));
        rcc.write(CR, CR_RESET | 1 << HSEON).unwrap();
        rcc.advance(10_000_000);
        assert_eq!((rcc.read(CR).unwrap() >> 17 & 1, rcc.set_crystal(false)), (0, Ok(false)));
    }

    #[test]
    fn a_clock_beyond_the_limit_is_refused() {
        let mut rcc = Rcc::new(0, Cause::Power, 0);
        rcc.write(PLLCFGR, 8 | 168 << 6 | 7 << 24).unwrap();
        rcc.write(CR, CR_RESET | 1 << PLLON).unwrap();
        rcc.advance(5_000);
        assert_eq!(rcc.write(CFGR, 2), Err(Refusal::Use("a clock is too fast for the chip")));
    }
}
