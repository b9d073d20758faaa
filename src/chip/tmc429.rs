//! Driver of the TMC429 motion controller: three ramp generators behind datagrams of 32 bits (TMC429 datasheet,
//! chapters 6 to 8).
//!
//! Registers that only the firmware changes are shadowed: writing a value that the chip already has costs no datagram.
//! Every datagram brings the chip's status byte along; the last one is kept. A datagram whose answer is lost is
//! repeated at once where that does no harm, up to twice.

use embedded_hal::spi::SpiDevice;

use super::REPEATS;
use super::error::Error;

/// A ramp generator of the chip, which has three.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RampGenerator {
    /// The first ramp generator, of motor 0.
    First = 0,
    /// The second ramp generator, of motor 1.
    Second = 1,
    /// The third ramp generator, of motor 2.
    Third = 2,
}

impl RampGenerator {
    /// All three ramp generators, in order.
    pub const ALL: [RampGenerator; 3] = [RampGenerator::First, RampGenerator::Second, RampGenerator::Third];
}

/// Registers of a ramp generator, by index (datasheet section 8.1). Velocities are 11 bits, 0..=2047 with a sign where
/// the direction matters; PULSE_DIV determines how many microsteps per second they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Register {
    /// Target position, 24 bits, in microsteps.
    XTarget = 0x0,
    /// Actual position, 24 bits, in microsteps; the chip counts the steps it makes.
    XActual = 0x1,
    /// Minimum velocity: a positioning motor starts and stops at this velocity without a ramp.
    VMin = 0x2,
    /// Maximum velocity.
    VMax = 0x3,
    /// Target velocity; the chip itself writes it in ramp and soft mode.
    VTarget = 0x4,
    /// Actual velocity.
    VActual = 0x5,
    /// Maximum acceleration, 0..=2047; RAMP_DIV and PULSE_DIV determine how many microsteps per second squared it is.
    AMax = 0x6,
    /// Actual acceleration, smoothed by the chip.
    AActual = 0x7,
    /// The braking parameter of positioning: PMUL in bits 15..8, PDIV in bits 3..0.
    PMulPDiv = 0x9,
    /// Reference switch configuration in bits 11..8, ramp mode in bits 1..0.
    RefConfMode = 0xA,
    /// Interrupt mask in bits 15..8, flags in bits 7..0.
    Interrupt = 0xB,
    /// PULSE_DIV in bits 15..12, RAMP_DIV in bits 11..8, USRS in bits 2..0.
    Divisors = 0xC,
    /// Distance from position zero, in microsteps, within which the reference switches do not stop the motor.
    DxRefTolerance = 0xD,
    /// The position latched at a reference switch; a write of any value arms the latch.
    XLatched = 0xE,
}

impl Register {
    /// How often a datagram to the register is repeated whose answer is lost: it may have reached the chip all the
    /// same. A second write to X_ACTUAL would lose the steps that the motor has made since the first. One to X_LATCHED
    /// would arm the latch anew, and one to the interrupt register would clear flags.
    #[inline]
    const fn repeats(self, reads: bool) -> u8 {
        match self {
            Register::XActual if !reads => 0,
            Register::XLatched | Register::Interrupt => 0,
            _ => REPEATS,
        }
    }
}

/// Marks contents of a register that are known, in a word of which the register has the low 24 bits.
const KNOWN: u32 = 1 << 31;

/// Number of register addresses of one ramp generator.
const REGISTERS: usize = 16;

/// Registers that the three ramp generators have in common (datasheet section 8.2), by their index with SMDA = 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Common {
    /// Interface configuration, see [`interface`].
    InterfaceConfiguration = 0x4,
    /// Type and version: reads 0x429101.
    TypeVersion = 0x9,
    /// State of the six reference switches.
    ReferenceSwitches = 0xE,
    /// Global parameters of the stepper motors: LSMD, the number of motors less one, and the timing of the step pulses.
    GlobalParameters = 0xF,
}

/// Bits of the interface configuration register (datasheet section 8.2.4).
pub mod interface {
    /// INV_REF: all reference switch inputs are inverted.
    pub const INV_REF: u32 = 1 << 0;
    /// SDO_INT: the pin nINT_SDO_C is the non-inverting SDO while the chip is selected, and high impedance otherwise.
    pub const SDO_INT: u32 = 1 << 1;
    /// INV_DIR: the direction outputs are inverted.
    pub const INV_DIR: u32 = 1 << 4;
    /// EN_SD: the outputs are step and direction, in place of an SPI chain of drivers.
    pub const EN_SD: u32 = 1 << 5;
    /// EN_REFR: the inputs of the right reference switches are enabled.
    pub const EN_REFR: u32 = 1 << 8;
}

/// Bits of [`Register::RefConfMode`] that concern the reference switches (datasheet section 8.1.11).
pub mod reference {
    /// DISABLE_STOP_L: the left switch does not stop the motor.
    pub const DISABLE_STOP_L: u32 = 1 << 8;
    /// DISABLE_STOP_R: the right switch does not stop the motor.
    pub const DISABLE_STOP_R: u32 = 1 << 9;
    /// SOFT_STOP: the switches stop the motor along the ramp, not at once.
    pub const SOFT_STOP: u32 = 1 << 10;
    /// REF_RnL: the position is latched at the right switch, not at the left one.
    pub const REF_RNL: u32 = 1 << 11;
    /// lp, read only: the latch is armed and has not latched a position yet.
    pub const LATCH_PENDING: u32 = 1 << 16;
}

/// How a ramp generator moves (datasheet section 8.1.11.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum RampMode {
    /// Positioning with a trapezoidal ramp.
    #[default]
    Ramp = 0,
    /// Positioning with an exponential approach.
    Soft = 1,
    /// Turning at a target velocity, which is reached by a ramp.
    Velocity = 2,
    /// Turning at the velocity that is written to V_ACTUAL, without a ramp.
    Hold = 3,
}

/// Reading of the type and version register (datasheet section 7.3).
const TYPE_VERSION: u32 = 0x42_9101;

/// Bit of the status byte: an interrupt is pending. All interrupts are masked, so the bit is set only where no chip
/// drives the bus.
const STATUS_INT: u8 = 1 << 7;

/// The data bits of a datagram.
const WORD: u32 = 0x00FF_FFFF;
/// The bit RW of a datagram's first byte: the register is read.
const READ: u8 = 1;
/// SMDA, the motor field of a datagram, for the registers in common.
const COMMON: u8 = 3;

/// The value of a register whose low `bits` (1..=32) are a number in two's complement.
pub const fn signed(word: u32, bits: u32) -> i32 {
    ((word << (32 - bits)) as i32) >> (32 - bits)
}

/// The chip on its SPI bus.
#[derive(Debug)]
pub struct Tmc429<SPI> {
    spi: SPI,
    /// Status byte of the last datagram that was answered.
    status: u8,
    /// A datagram and its repetitions were not answered, and the chip has not answered [`confirm`](Self::confirm)
    /// since.
    unanswered: bool,
    /// The states of the reference switches as read for several who ask; `None` if that is too long ago.
    switches: Option<u32>,
    /// The contents of the registers with [`KNOWN`], by ramp generator and register; 0 where they are not known.
    shadow: [[u32; REGISTERS]; 3],
    /// The interface configuration with [`KNOWN`], or 0.
    interface: u32,
}

impl<SPI: SpiDevice> Tmc429<SPI> {
    /// The chip on an SPI device in mode 3, with unknown register contents: after a warm start its motors may be
    /// running.
    pub const fn new(spi: SPI) -> Self {
        let shadow = [[0; REGISTERS]; 3];
        Tmc429 { spi, status: 0, unanswered: false, switches: None, shadow, interface: 0 }
    }

    /// Stops all motors at once, whatever they were doing. A zero that is written to V_ACTUAL in hold mode, the only
    /// mode in which that is allowed (datasheet section 8.1.6), ends the motion with the next pulse. Interrupts are
    /// masked: another firmware may have left them on, and a pending interrupt looks like a chip that does not answer.
    ///
    /// # Errors
    /// The error of the first datagram that did not get through; the others are sent all the same.
    pub fn halt(&mut self) -> Result<(), Error<SPI::Error>> {
        let disabled = reference::DISABLE_STOP_L | reference::DISABLE_STOP_R;
        let words = [
            (Register::Interrupt, 0),
            (Register::RefConfMode, disabled | RampMode::Hold as u32),
            (Register::VTarget, 0),
            (Register::VActual, 0),
        ];
        let mut result = Ok(());
        for generator in RampGenerator::ALL {
            for (register, word) in words {
                result = result.and(self.write(generator, register, word));
            }
        }
        result
    }

    /// Sets the outputs of all three motors to step and direction, and enables their right switches.
    ///
    /// # Errors
    /// A datagram did not get through.
    pub fn initialise(&mut self) -> Result<(), Error<SPI::Error>> {
        // LSMD = 2 is three motors. With all other fields zero a step pulse has 16 clocks, 1 us at 16 MHz (datasheet
        // chapter 9, STPDIV_429 = 0).
        self.transfer(COMMON, Common::GlobalParameters as u8, Some(0x2), REPEATS)?;
        self.write_interface(false, false)
    }

    /// Writes the interface configuration, in which the switch inputs and the direction outputs of all three motors can
    /// be inverted.
    ///
    /// # Errors
    /// The datagram did not get through.
    pub fn write_interface(&mut self, invert_switches: bool, invert_direction: bool) -> Result<(), Error<SPI::Error>> {
        let mut word = interface::EN_REFR | interface::EN_SD | interface::SDO_INT;
        if invert_switches {
            word |= interface::INV_REF;
        }
        if invert_direction {
            word |= interface::INV_DIR;
        }
        if self.interface != word | KNOWN {
            self.interface = 0;
            self.transfer(COMMON, Common::InterfaceConfiguration as u8, Some(word), REPEATS)?;
            self.interface = word | KNOWN;
        }
        Ok(())
    }

    /// Writes the low 24 bits of `word` to a register of one motor, unless the register is known to have that value.
    ///
    /// # Errors
    /// The datagram did not get through; then the register's contents count as unknown.
    pub fn write(&mut self, generator: RampGenerator, register: Register, word: u32) -> Result<(), Error<SPI::Error>> {
        let word = word & WORD;
        // These registers are changed by the chip itself, or each write to them has an effect: so they are always
        // written.
        let lively = matches!(
            register,
            Register::XActual | Register::VActual | Register::VTarget | Register::Interrupt | Register::XLatched
        );
        if self.holds(generator, register, word) {
            return Ok(());
        }
        // After a datagram that did not get through the register may contain either value.
        let result = self.transfer(generator as u8, register as u8, Some(word), register.repeats(false));
        if let Some(known) = self.shadow.get_mut(generator as usize).and_then(|r| r.get_mut(register as usize)) {
            *known = if lively || result.is_err() { 0 } else { word | KNOWN };
        }
        result.map(drop)
    }

    /// Makes `position` the actual position of a motor that stands: then nothing is lost by a second write.
    ///
    /// # Errors
    /// The datagram did not get through; the chip may have the position all the same.
    pub fn place_standing(&mut self, generator: RampGenerator, position: u32) -> Result<(), Error<SPI::Error>> {
        self.transfer(generator as u8, Register::XActual as u8, Some(position), REPEATS).map(drop)
    }

    /// True when the chip is known to hold `word` in this register.
    pub fn holds(&self, generator: RampGenerator, register: Register, word: u32) -> bool {
        self.shadow.get(generator as usize).and_then(|r| r.get(register as usize)) == Some(&(word | KNOWN))
    }

    /// Reads the 24 bits of a register of one motor.
    ///
    /// # Errors
    /// The chip did not answer, or has not been [confirmed](Self::confirm) since it once did not.
    pub fn read(&mut self, generator: RampGenerator, register: Register) -> Result<u32, Error<SPI::Error>> {
        self.transfer(generator as u8, register as u8, None, register.repeats(true))
    }

    /// Reads the states of the six reference switches, after inversion: bit 2n is the right switch of motor n, bit 2n +
    /// 1 its left one.
    ///
    /// # Errors
    /// As of [`read`](Self::read).
    pub fn reference_switches(&mut self) -> Result<u32, Error<SPI::Error>> {
        self.transfer(COMMON, Common::ReferenceSwitches as u8, None, REPEATS)
    }

    /// The stop switches for several who ask within a short time: the register is read once, until [it is
    /// forgotten](Self::forget_switches).
    ///
    /// # Errors
    /// As of [`read`](Self::read).
    pub fn switches_once(&mut self) -> Result<u32, Error<SPI::Error>> {
        match self.switches {
            Some(bits) => Ok(bits),
            None => self.reference_switches().inspect(|bits| self.switches = Some(*bits)),
        }
    }

    /// From now on what [`switches_once`](Self::switches_once) has read is too old.
    pub const fn forget_switches(&mut self) {
        self.switches = None;
    }

    /// Asks the chip for its type and version, which shows that chip and bus work. A bus that reads as all zeros is
    /// noticed only by this.
    ///
    /// # Errors
    /// The chip did not answer with its version. Until it does, no reading counts as answered.
    pub fn confirm(&mut self) -> Result<(), Error<SPI::Error>> {
        // One that has not answered is asked once.
        let repeats = if core::mem::take(&mut self.unanswered) { 0 } else { REPEATS };
        let version = self.transfer(COMMON, Common::TypeVersion as u8, None, repeats)?;
        self.unanswered = version != TYPE_VERSION;
        if self.unanswered { Err(Error::NoAnswer) } else { Ok(()) }
    }

    /// True while all datagrams since the last [`confirm`](Self::confirm) have been answered.
    pub const fn answers(&self) -> bool {
        !self.unanswered
    }

    /// True if the left reference switch was active at the last datagram, after inversion.
    pub const fn left_switch(&self, generator: RampGenerator) -> bool {
        self.status & (2 << (2 * generator as u8)) != 0
    }

    /// Exchanges one datagram: SMDA and register index, and then 24 bits to be written, or the read bit and zeros. The
    /// first byte of the answer is the status (datasheet section 6.2.2.2). If the answer is lost the datagram is
    /// repeated up to `repeats` times, but not to a chip that has not been confirmed since it did not answer.
    fn transfer(&mut self, smda: u8, index: u8, write: Option<u32>, repeats: u8) -> Result<u32, Error<SPI::Error>> {
        let read = if write.is_none() { READ } else { 0 };
        let word = u32::from(smda << 5 | index << 1 | read) << 24 | write.unwrap_or(0) & WORD;
        let mut left = if self.unanswered { 0 } else { repeats };
        let mut answer = self.exchange(word)?;
        while is_lost(answer) && left > 0 {
            left = left.saturating_sub(1);
            answer = self.exchange(word)?;
        }
        self.unanswered |= is_lost(answer);
        // After a lost answer a write may have reached the chip all the same, but what was read may mean nothing.
        if is_lost(answer) || self.unanswered && write.is_none() {
            return Err(Error::NoAnswer);
        }
        self.status = (answer >> 24) as u8;
        Ok(answer & WORD)
    }

    /// Exchanges the 32 bits of a datagram for those of the answer. Not inlined, because a datagram may be repeated.
    #[inline(never)]
    fn exchange(&mut self, word: u32) -> Result<u32, Error<SPI::Error>> {
        let mut datagram = word.to_be_bytes();
        self.spi.transfer_in_place(&mut datagram).map_err(Error::Spi)?;
        Ok(u32::from_be_bytes(datagram))
    }
}

/// True if no chip has sent this answer.
#[inline]
const fn is_lost(answer: u32) -> bool {
    answer >> 24 & STATUS_INT as u32 != 0
}
