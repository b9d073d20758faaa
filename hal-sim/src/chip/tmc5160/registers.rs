//! The register file: addresses, widths, ways of access and power-on contents, typed from the datasheet's register
//! mapping (6).

/// Addresses (6.1 to 6.5).
pub(super) mod address {
    pub(crate) const GCONF: u8 = 0x00;
    pub(crate) const GSTAT: u8 = 0x01;
    pub(crate) const SLAVECONF: u8 = 0x03;
    /// IOIN when it is read, OUTPUT when it is written.
    pub(crate) const IOIN: u8 = 0x04;
    pub(crate) const X_COMPARE: u8 = 0x05;
    pub(crate) const OTP_PROG: u8 = 0x06;
    pub(crate) const OTP_READ: u8 = 0x07;
    pub(crate) const FACTORY_CONF: u8 = 0x08;
    pub(crate) const SHORT_CONF: u8 = 0x09;
    pub(crate) const DRV_CONF: u8 = 0x0A;
    pub(crate) const GLOBALSCALER: u8 = 0x0B;
    pub(crate) const IHOLD_IRUN: u8 = 0x10;
    pub(crate) const TPOWERDOWN: u8 = 0x11;
    pub(crate) const TSTEP: u8 = 0x12;
    pub(crate) const TPWMTHRS: u8 = 0x13;
    pub(crate) const TCOOLTHRS: u8 = 0x14;
    pub(crate) const THIGH: u8 = 0x15;
    pub(crate) const RAMPMODE: u8 = 0x20;
    pub(crate) const XACTUAL: u8 = 0x21;
    pub(crate) const VACTUAL: u8 = 0x22;
    pub(crate) const VSTART: u8 = 0x23;
    pub(crate) const A1: u8 = 0x24;
    pub(crate) const V1: u8 = 0x25;
    pub(crate) const AMAX: u8 = 0x26;
    pub(crate) const VMAX: u8 = 0x27;
    pub(crate) const DMAX: u8 = 0x28;
    pub(crate) const D1: u8 = 0x2A;
    pub(crate) const VSTOP: u8 = 0x2B;
    pub(crate) const TZEROWAIT: u8 = 0x2C;
    pub(crate) const XTARGET: u8 = 0x2D;
    pub(crate) const VDCMIN: u8 = 0x33;
    pub(crate) const SW_MODE: u8 = 0x34;
    pub(crate) const RAMP_STAT: u8 = 0x35;
    pub(crate) const XLATCH: u8 = 0x36;
    pub(crate) const ENCMODE: u8 = 0x38;
    pub(crate) const X_ENC: u8 = 0x39;
    pub(crate) const ENC_CONST: u8 = 0x3A;
    pub(crate) const ENC_STATUS: u8 = 0x3B;
    pub(crate) const ENC_LATCH: u8 = 0x3C;
    pub(crate) const ENC_DEVIATION: u8 = 0x3D;
    pub(crate) const MSLUT: u8 = 0x60;
    pub(crate) const MSLUTSEL: u8 = 0x68;
    pub(crate) const MSLUTSTART: u8 = 0x69;
    pub(crate) const MSCNT: u8 = 0x6A;
    pub(crate) const MSCURACT: u8 = 0x6B;
    pub(crate) const CHOPCONF: u8 = 0x6C;
    pub(crate) const COOLCONF: u8 = 0x6D;
    pub(crate) const DCCTRL: u8 = 0x6E;
    pub(crate) const DRV_STATUS: u8 = 0x6F;
    pub(crate) const PWMCONF: u8 = 0x70;
    pub(crate) const PWM_SCALE: u8 = 0x71;
    pub(crate) const PWM_AUTO: u8 = 0x72;
    /// Bit 7 of the first byte of a datagram (4.1.1).
    pub(crate) const WRITE: u8 = 0x80;
}

use address::*;

/// Number of addresses.
const ADDRESSES: usize = 128;

/// How a register that keeps what was written is read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Access {
    /// The register reads what was written.
    Both,
    /// The register cannot be read: the address reads 0, or another register.
    WriteOnly,
}

use Access::{Both, WriteOnly};

/// The registers that keep what is written, with the widths and power-on contents; OTP bits are taken as 0, but for the
/// clock trim of [`OTP`].
const KEPT: &[(u8, Access, u32, u32)] = &[
    (GCONF, Both, 0x3_FFFF, 0x8),
    (SLAVECONF, WriteOnly, 0xFFF, 0),
    (IOIN, WriteOnly, 1, 1),
    (X_COMPARE, WriteOnly, u32::MAX, 0),
    (OTP_PROG, WriteOnly, 0xFF37, 0),
    (FACTORY_CONF, Both, 0x1F, OTP),
    (SHORT_CONF, WriteOnly, 0x7_0F0F, 0x1_0606),
    (DRV_CONF, WriteOnly, 0x3F_0F1F, 0x8_0400),
    (GLOBALSCALER, WriteOnly, 0xFF, 0),
    (IHOLD_IRUN, WriteOnly, 0xF_1F1F, 0),
    (TPOWERDOWN, WriteOnly, 0xFF, 10),
    (TPWMTHRS, WriteOnly, 0xF_FFFF, 0),
    (TCOOLTHRS, WriteOnly, 0xF_FFFF, 0),
    (THIGH, WriteOnly, 0xF_FFFF, 0),
    (RAMPMODE, Both, 0x3, 0),
    (VSTART, WriteOnly, 0x3_FFFF, 0),
    (A1, WriteOnly, 0xFFFF, 0),
    (V1, WriteOnly, 0xF_FFFF, 0),
    (AMAX, WriteOnly, 0xFFFF, 0),
    (VMAX, WriteOnly, 0x7F_FFFF, 0),
    (DMAX, WriteOnly, 0xFFFF, 0),
    (D1, WriteOnly, 0xFFFF, 0),
    (VSTOP, WriteOnly, 0x3_FFFF, 1),
    (TZEROWAIT, WriteOnly, 0xFFFF, 0),
    (XTARGET, Both, u32::MAX, 0),
    // Only bits 22..8 are used (6.3.2).
    (VDCMIN, WriteOnly, 0x7F_FF00, 0),
    (SW_MODE, Both, 0xFFF, 0),
    (ENCMODE, Both, 0x7FF, 0),
    (ENC_CONST, WriteOnly, u32::MAX, 0x1_0000),
    (ENC_DEVIATION, WriteOnly, 0xF_FFFF, 0),
    (MSLUT, WriteOnly, u32::MAX, 0xAAAA_B554),
    (MSLUT + 1, WriteOnly, u32::MAX, 0x4A95_54AA),
    (MSLUT + 2, WriteOnly, u32::MAX, 0x2449_2929),
    (MSLUT + 3, WriteOnly, u32::MAX, 0x1010_4222),
    (MSLUT + 4, WriteOnly, u32::MAX, 0xFBFF_FFFF),
    (MSLUT + 5, WriteOnly, u32::MAX, 0xB5BB_777D),
    (MSLUT + 6, WriteOnly, u32::MAX, 0x4929_5556),
    (MSLUT + 7, WriteOnly, u32::MAX, 0x0040_4222),
    (MSLUTSEL, WriteOnly, u32::MAX, 0xFFFF_8056),
    (MSLUTSTART, WriteOnly, 0xFF_00FF, 0xF7_0000),
    (CHOPCONF, Both, u32::MAX, 0x1041_0150),
    (COOLCONF, WriteOnly, 0x1FF_FFFF, 0),
    (DCCTRL, WriteOnly, 0xFF_03FF, 0),
    (PWMCONF, WriteOnly, u32::MAX, 0xC40C_001E),
];

/// The value of OTP_READ: a trim of the internal clock in the middle of its range, all else 0 (6.1.1).
pub(super) const OTP: u32 = 0x10;

/// The registers that keep what is written. Those that the chip writes itself are in the parts that they belong to.
#[derive(Clone, Debug)]
pub(super) struct Registers([u32; ADDRESSES]);

impl Registers {
    /// The power-on contents.
    pub(super) fn new() -> Self {
        let mut contents = [0; ADDRESSES];
        for &(address, _, _, reset) in KEPT {
            contents[usize::from(address)] = reset;
        }
        Self(contents)
    }

    /// The contents of a register that keeps what is written; 0 for any other address.
    pub(super) fn get(&self, address: u8) -> u32 {
        self.0.get(usize::from(address)).copied().unwrap_or(0)
    }

    /// A field of a register.
    pub(super) fn field(&self, address: u8, low: u32, bits: u32) -> u32 {
        crate::chip::bits::field(self.get(address), low, bits)
    }

    /// A bit of a register.
    pub(super) fn bit(&self, address: u8, bit: u32) -> bool {
        self.field(address, bit, 1) != 0
    }

    /// Gives what a host reads: 0 where nothing can be read.
    pub(super) fn read(&self, address: u8) -> u32 {
        let readable = KEPT.iter().any(|(kept, access, ..)| *kept == address && *access == Both);
        if readable { self.get(address) } else { 0 }
    }

    /// Writes as many bits as the register has; nothing where it has none.
    pub(super) fn write(&mut self, address: u8, data: u32) {
        if let Some((_, _, mask, _)) = KEPT.iter().find(|(kept, ..)| *kept == address) {
            self.0[usize::from(address)] = data & mask;
        }
    }
}
