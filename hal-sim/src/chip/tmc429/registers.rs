//! Addresses, fields and power-on contents, typed from the datasheet's register mapping (7.3).

/// Registers of an axis by IDX (8.1).
pub(super) mod axis {
    pub(crate) const X_TARGET: u8 = 0x0;
    pub(crate) const X_ACTUAL: u8 = 0x1;
    pub(crate) const V_MIN: u8 = 0x2;
    pub(crate) const V_MAX: u8 = 0x3;
    pub(crate) const V_TARGET: u8 = 0x4;
    pub(crate) const V_ACTUAL: u8 = 0x5;
    pub(crate) const A_MAX: u8 = 0x6;
    pub(crate) const A_ACTUAL: u8 = 0x7;
    pub(crate) const CURRENT_SCALE: u8 = 0x8;
    pub(crate) const PMUL_PDIV: u8 = 0x9;
    pub(crate) const REF_CONF_MODE: u8 = 0xA;
    pub(crate) const INTERRUPTS: u8 = 0xB;
    pub(crate) const DIVIDERS: u8 = 0xC;
    pub(crate) const DX_REF_TOLERANCE: u8 = 0xD;
    pub(crate) const X_LATCHED: u8 = 0xE;
    pub(crate) const USTEP_COUNT: u8 = 0xF;

    pub(crate) const POSITION_BITS: u32 = 24;
    pub(crate) const POSITION_MASK: u32 = 0xFF_FFFF;
    pub(crate) const SIGNED_VELOCITY_BITS: u32 = 12;
    pub(crate) const SIGNED_VELOCITY_MASK: u32 = 0xFFF;
    /// V_MIN, V_MAX and A_MAX have 11 bits.
    pub(crate) const UNSIGNED_MASK: u32 = 0x7FF;
    /// IS_AGTAT 22:20, IS_ALEAT 18:16, IS_V0 14:12, A_THRESHOLD 10:0.
    pub(crate) const CURRENT_SCALE_MASK: u32 = 0x77_77FF;
    pub(crate) const PMUL_SHIFT: u32 = 8;
    pub(crate) const PMUL_MASK: u32 = 0xFF;
    /// The MSB of PMUL is fixed to 1 (8.1.10.1).
    pub(crate) const PMUL_FIXED: u32 = 0x8000;
    pub(crate) const PDIV_MASK: u32 = 0xF;
    pub(crate) const LP_SHIFT: u32 = 16;
    pub(crate) const MODE_MASK: u32 = 0x3;
    pub(crate) const INTERRUPT_MASK_SHIFT: u32 = 8;
    pub(crate) const PULSE_DIV_SHIFT: u32 = 12;
    pub(crate) const RAMP_DIV_SHIFT: u32 = 8;
    pub(crate) const DIVIDER_MASK: u32 = 0xF;
    pub(crate) const USRS_MASK: u32 = 0x7;
    pub(crate) const TOLERANCE_MASK: u32 = 0xFFF;
    pub(crate) const USTEP_MASK: u32 = 0xFF;
}

/// Bits of REF_CONF at their place in the register (8.1.11.2).
pub(super) mod ref_conf {
    pub(crate) const DISABLE_STOP_L: u32 = 1 << 8;
    pub(crate) const DISABLE_STOP_R: u32 = 1 << 9;
    pub(crate) const SOFT_STOP: u32 = 1 << 10;
    pub(crate) const REF_RNL: u32 = 1 << 11;
    pub(crate) const MASK: u32 = 0xF00;
}

/// Interrupt flags of an axis; the masks have the same order, 8 bits higher (8.1.12).
pub(super) mod interrupt {
    pub(crate) const POS_END: u32 = 1 << 0;
    pub(crate) const REF_WRONG: u32 = 1 << 1;
    pub(crate) const REF_MISS: u32 = 1 << 2;
    pub(crate) const STOP: u32 = 1 << 3;
    pub(crate) const STOP_LEFT_LOW: u32 = 1 << 4;
    pub(crate) const STOP_RIGHT_LOW: u32 = 1 << 5;
    pub(crate) const STOP_LEFT_HIGH: u32 = 1 << 6;
    pub(crate) const STOP_RIGHT_HIGH: u32 = 1 << 7;
    pub(crate) const ALL: u32 = 0xFF;
}

/// Common registers by JDX (8.2).
pub(super) mod common {
    pub(crate) const DATAGRAM_LOW_WORD: u8 = 0x0;
    pub(crate) const DATAGRAM_HIGH_WORD: u8 = 0x1;
    pub(crate) const COVER_POS_LEN: u8 = 0x2;
    pub(crate) const COVER_DATAGRAM: u8 = 0x3;
    pub(crate) const IF_CONFIGURATION: u8 = 0x4;
    pub(crate) const POS_COMP: u8 = 0x5;
    pub(crate) const POS_COMP_INT: u8 = 0x6;
    pub(crate) const POWER_DOWN: u8 = 0x8;
    pub(crate) const TYPE_VERSION: u8 = 0x9;
    pub(crate) const REFERENCE_SWITCHES: u8 = 0xE;
    pub(crate) const GLOBAL_PARAMETERS: u8 = 0xF;

    /// TMC429 version 1.01 (8.2.4.4).
    pub(crate) const VERSION: u32 = 0x42_9101;
    pub(crate) const DATAGRAM_MASK: u32 = 0xFF_FFFF;
    pub(crate) const COVER_WAITING: u32 = 1 << 23;
    pub(crate) const COVER_POS_SHIFT: u32 = 8;
    pub(crate) const COVER_POS_MASK: u32 = 0x3F;
    pub(crate) const COVER_LEN_MASK: u32 = 0x1F;
    pub(crate) const POS_COMP_INT_MASK: u32 = 1 << 8;
    pub(crate) const POS_COMP_INT_FLAG: u32 = 1 << 0;
}

/// Bits of IF_CONFIGURATION_429 (8.2.4).
pub(super) mod interface {
    pub(crate) const INV_REF: u32 = 1 << 0;
    pub(crate) const SDO_INT: u32 = 1 << 1;
    pub(crate) const STEP_HALF: u32 = 1 << 2;
    pub(crate) const INV_DIR: u32 = 1 << 4;
    pub(crate) const EN_SD: u32 = 1 << 5;
    pub(crate) const POS_COMP_SEL_SHIFT: u32 = 6;
    pub(crate) const POS_COMP_SEL_MASK: u32 = 0x3;
    pub(crate) const EN_REFR: u32 = 1 << 8;
    pub(crate) const MASK: u32 = 0x1FF;
}

/// Fields of the stepper motor global parameter register (8.2.5).
pub(super) mod global {
    pub(crate) const LSMD_MASK: u32 = 0x3;
    pub(crate) const CLK2_DIV_SHIFT: u32 = 8;
    pub(crate) const CLK2_DIV_MASK: u32 = 0xFF;
    /// The four low bits of CLK2_DIV set the timing of step pulses (10.1).
    pub(crate) const STPDIV_MASK: u32 = 0xF;
    pub(crate) const CONTINUOUS_UPDATE: u32 = 1 << 16;
    pub(crate) const MOT1R: u32 = 1 << 21;
    /// mot1r, refmux, continuous_update, CLK2_DIV, csCommonIndividual, POLARITIES, LSMD.
    pub(crate) const MASK: u32 = 0x31_FFFF;
    /// The one register that is not 0 after power-on: CLK2_DIV = 15 (7.3).
    pub(crate) const POWER_ON: u32 = 15 << CLK2_DIV_SHIFT;
}

/// The on-chip RAM (11.3).
pub(super) mod ram {
    pub(crate) const CELLS: usize = 128;
    pub(crate) const CELL_MASK: u32 = 0x3F;
    pub(crate) const ODD_SHIFT: u32 = 8;
    /// Next-motor bit of a driver configuration code word.
    pub(crate) const NXM: u8 = 0x20;
    /// Cells of the driver chain configuration; the microstep table follows.
    pub(crate) const CONFIGURATION: usize = 64;
    /// Power-on configuration of one driver of the chain; all three are alike (11.4.2, values in braces).
    pub(crate) const DRIVER: [u8; 12] = [0x11, 0x05, 0x04, 0x03, 0x02, 0x06, 0x11, 0x0D, 0x0C, 0x0B, 0x0A, 0x2E];
    /// Drivers in the power-on configuration.
    pub(crate) const DRIVERS: usize = 3;
    /// A quarter of a sine wave (11.5). The offset that the power-on table carries is not published.
    pub(crate) const SINE: [u8; 64] = [
        0, 2, 3, 5, 6, 8, 9, 11, 12, 14, 16, 17, 19, 20, 22, 23, 24, 26, 27, 29, 30, 32, 33, 34, 36, 37, 38, 39, 41,
        42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56, 56, 57, 58, 59, 59, 60, 60, 61, 61, 62, 62, 62, 63,
        63, 63, 63, 63, 63, 63, 63,
    ];
}
