//! The common registers, the on-chip RAM, and the little of the SPI driver chain that can be seen from outside.

use super::CYCLES_PER_TICK;
use super::registers::{common, global, interface, ram};

/// Left and right switches in REFERENCE_SWITCHES order (datasheet 8.2.4.5).
const RIGHT_SWITCHES: u8 = 0b01_01_01;
const LEFT_SWITCHES: u8 = 0b10_10_10;
const R1: u8 = 1 << 0;
const L3: u8 = 1 << 5;

/// A datagram to the driver chain has at most this many bits (1.2.3).
const LONGEST_DATAGRAM: u64 = 64;

/// Registers with SMDA = %11, and the RAM.
#[derive(Debug)]
pub(super) struct Global {
    interface: u32,
    parameters: u32,
    compare_position: u32,
    compare_mask: bool,
    compare_flag: bool,
    compare_matched: bool,
    cover_position: u32,
    cover_length: u32,
    cover_datagram: u32,
    cover_waiting: bool,
    words_waiting: bool,
    /// The tick at which the datagram that is under way to the driver chain has been sent.
    sent_at: Option<u64>,
    ram: [u8; ram::CELLS],
}

impl Global {
    /// Power-on state (7.3, 11.4.2).
    pub(super) fn new() -> Self {
        let mut cells = [0; ram::CELLS];
        let (configuration, sine) = cells.split_at_mut(ram::CONFIGURATION);
        for driver in configuration.chunks_exact_mut(ram::DRIVER.len()).take(ram::DRIVERS) {
            driver.copy_from_slice(&ram::DRIVER);
        }
        sine.copy_from_slice(&ram::SINE);
        Self {
            interface: 0,
            parameters: global::POWER_ON,
            compare_position: 0,
            compare_mask: false,
            compare_flag: false,
            compare_matched: true,
            cover_position: 0,
            cover_length: 0,
            cover_datagram: 0,
            cover_waiting: false,
            words_waiting: false,
            sent_at: None,
            ram: cells,
        }
    }

    /// The active switches for the levels at the pins, both in REFERENCE_SWITCHES order.
    ///
    /// refmux has no part in it: it needs a 74HC157 on the SPI driver signals, which a module with
    /// step/direction drivers cannot have (8.2.4). mot1r moves the input REF3 to the right of motor 1 and
    /// is meant for packages without right inputs (9.1), so it gives way to en_refr.
    pub(super) fn switches(&self, pins: u8) -> u8 {
        let levels = if self.interface & interface::INV_REF != 0 { !pins } else { pins };
        let left = levels & LEFT_SWITCHES;
        if self.interface & interface::EN_REFR != 0 {
            left | levels & RIGHT_SWITCHES
        } else if self.parameters & global::MOT1R != 0 {
            left & !L3 | if left & L3 != 0 { R1 } else { 0 }
        } else {
            left
        }
    }

    /// True if step and direction go to the drivers (en_sd).
    pub(super) fn step_direction(&self) -> bool {
        self.interface & interface::EN_SD != 0
    }

    /// The level of a direction output for counting up or down.
    pub(super) fn direction_pin(&self, up: bool) -> bool {
        up != (self.interface & interface::INV_DIR != 0)
    }

    /// True if nINT_SDO_C carries nINT at all times (sdo_int).
    pub(super) fn interrupt_only(&self) -> bool {
        self.interface & interface::SDO_INT != 0
    }

    /// Length of a step pulse in periods of CLK, 16 * (1 + STPDIV_429) (10.1). None with step_half, where
    /// each step is one edge.
    pub(super) fn pulse_cycles(&self) -> Option<u64> {
        let stpdiv = self.parameters >> global::CLK2_DIV_SHIFT & global::STPDIV_MASK;
        (self.interface & interface::STEP_HALF == 0).then(|| 16 * (1 + u64::from(stpdiv)))
    }

    /// The motor selected for the position compare output. %11 is none.
    pub(super) fn compare_motor(&self) -> usize {
        (self.interface >> interface::POS_COMP_SEL_SHIFT & interface::POS_COMP_SEL_MASK) as usize
    }

    /// The position, of 24 bits, with which the selected motor's is compared.
    pub(super) fn compare_position(&self) -> u32 {
        self.compare_position
    }

    /// Compares the selected motor's position (24 bit); its interrupt comes when they begin to match.
    pub(super) fn compare(&mut self, position: Option<u32>) {
        let matches = position == Some(self.compare_position);
        if matches && !self.compare_matched {
            self.compare_flag = self.compare_mask;
        }
        self.compare_matched = matches;
    }

    /// Level of the position compare output (8.2.4.1).
    pub(super) fn compare_matched(&self) -> bool {
        self.compare_matched
    }

    /// True if the interrupt flag of the position compare function is set.
    pub(super) fn interrupt(&self) -> bool {
        self.compare_flag
    }

    /// The status bit CDGW (8.2.1.1).
    pub(super) fn datagram_waiting(&self) -> bool {
        self.cover_waiting || self.words_waiting
    }

    /// The tick at which the datagram on its way to the driver chain will have been sent; `None` without one.
    pub(super) fn sent_at(&self) -> Option<u64> {
        self.sent_at
    }

    /// Ends a datagram to the driver chain that has been sent by `tick`.
    pub(super) fn finish_datagram(&mut self, tick: u64) {
        if self.sent_at.is_some_and(|sent| sent <= tick) {
            self.sent_at = None;
            self.cover_waiting = false;
            self.words_waiting = false;
        }
    }

    /// Begins the datagram that a step sends to the driver chain. It is timed only if CDGW shows that data wait for it.
    pub(super) fn send_datagram(&mut self, tick: u64) {
        if !self.step_direction() && self.datagram_waiting() && self.sent_at.is_none() {
            self.sent_at = Some(tick + self.datagram_cycles().div_ceil(CYCLES_PER_TICK));
        }
    }

    /// Periods of CLK of a datagram: f_CLK / f_SCK_S = 2 * (CLK2_DIV + 1) for each of its bits, one more for
    /// each driver, and two (8.2.5.3).
    fn datagram_cycles(&self) -> u64 {
        let drivers = u64::from(self.parameters & global::LSMD_MASK) + 1;
        let mut seen = 0;
        let mut bits = 0;
        for cell in &self.ram[..ram::CONFIGURATION] {
            bits += 1;
            seen += u64::from(cell & ram::NXM != 0);
            if seen == drivers {
                break;
            }
        }
        let divider = u64::from(self.parameters >> global::CLK2_DIV_SHIFT & global::CLK2_DIV_MASK);
        2 * (divider + 1) * (bits.min(LONGEST_DATAGRAM) + drivers + 2)
    }

    /// Reads a common register by JDX. Addresses without a register read 0.
    pub(super) fn read(&self, index: u8, pins: u8) -> u32 {
        match index {
            common::COVER_POS_LEN => {
                let waiting = if self.cover_waiting { common::COVER_WAITING } else { 0 };
                waiting | self.cover_position << common::COVER_POS_SHIFT | self.cover_length
            }
            common::COVER_DATAGRAM => self.cover_datagram,
            common::IF_CONFIGURATION => self.interface,
            common::POS_COMP => self.compare_position,
            common::POS_COMP_INT => {
                let mask = if self.compare_mask { common::POS_COMP_INT_MASK } else { 0 };
                mask | if self.compare_flag { common::POS_COMP_INT_FLAG } else { 0 }
            }
            common::TYPE_VERSION => common::VERSION,
            common::REFERENCE_SWITCHES => u32::from(self.switches(pins)),
            common::GLOBAL_PARAMETERS => self.parameters,
            // The two DATAGRAM words read 0 as well, because nothing drives SDI_S, which is pulled down (4).
            _ => 0,
        }
    }

    /// Writes a common register by JDX at tick `tick`.
    pub(super) fn write(&mut self, index: u8, data: u32, tick: u64) {
        match index {
            common::DATAGRAM_LOW_WORD | common::DATAGRAM_HIGH_WORD => self.words_waiting = true,
            common::COVER_POS_LEN => {
                // The chip stores COVER_POS + 1 (8.2.2).
                self.cover_position = ((data >> common::COVER_POS_SHIFT) + 1) & common::COVER_POS_MASK;
                self.cover_length = data & common::COVER_LEN_MASK;
            }
            common::COVER_DATAGRAM => {
                self.cover_datagram = data & common::DATAGRAM_MASK;
                self.cover_waiting = true;
            }
            common::IF_CONFIGURATION => self.interface = data & interface::MASK,
            common::POS_COMP => self.compare_position = data & common::DATAGRAM_MASK,
            common::POS_COMP_INT => {
                // Cleared like the flags of the axes (8.1.12), by a 1 or with the mask.
                self.compare_mask = data & common::POS_COMP_INT_MASK != 0;
                self.compare_flag &= self.compare_mask && data & common::POS_COMP_INT_FLAG == 0;
            }
            common::GLOBAL_PARAMETERS => self.parameters = data & global::MASK,
            _ => {}
        }
        // A cover datagram does not wait for a step (8.2.3), nor does anything with continuous_update.
        if self.cover_waiting || self.parameters & global::CONTINUOUS_UPDATE != 0 {
            self.send_datagram(tick);
        }
    }

    /// Reads the pair of RAM cells at `address` (0..=63).
    pub(super) fn read_ram(&self, address: u8) -> u32 {
        self.ram
            .chunks_exact(2)
            .nth(usize::from(address))
            .map_or(0, |pair| u32::from(pair[0]) | u32::from(pair[1]) << ram::ODD_SHIFT)
    }

    /// Writes the pair of RAM cells at `address` (0..=63).
    pub(super) fn write_ram(&mut self, address: u8, data: u32) {
        if let Some(pair) = self.ram.chunks_exact_mut(2).nth(usize::from(address)) {
            pair[0] = (data & ram::CELL_MASK) as u8;
            pair[1] = (data >> ram::ODD_SHIFT & ram::CELL_MASK) as u8;
        }
    }
}
