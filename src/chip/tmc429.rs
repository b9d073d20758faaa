//! Driver of the TMC429 motion controller: three ramp generators behind 32-bit datagrams (TMC429 datasheet
//! chapters 6 to 8).
//!
//! Registers that only the firmware changes are shadowed: writing a value that the chip already has costs no datagram.
//! Every datagram brings the chip's status byte along; the last one is kept.

use embedded_hal::spi::{self, ErrorKind, SpiDevice};

/// Why a datagram was of no use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus failed.
    Spi(E),
    /// The chip did not answer: the bus reads as if nobody drove it, or the version is not that of a TMC429.
    NoAnswer,
}

impl<E: spi::Error> spi::Error for Error<E> {
    fn kind(&self) -> ErrorKind {
        match self {
            Error::Spi(error) => error.kind(),
            Error::NoAnswer => ErrorKind::Other,
        }
    }
}

/// One of the chip's three ramp generators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RampGenerator {
    /// The first.
    First = 0,
    /// The second.
    Second = 1,
    /// The third.
    Third = 2,
}

impl RampGenerator {
    /// All three, in order.
    pub const ALL: [RampGenerator; 3] = [RampGenerator::First, RampGenerator::Second, RampGenerator::Third];
}

/// Registers of a ramp generator, by index (datasheet section 8.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Register {
    /// Target position, 24 bits, in microsteps.
    XTarget = 0x0,
    /// Actual position, 24 bits, in microsteps; the chip counts the steps it makes.
    XActual = 0x1,
    /// Speed at which a motor starts and stops without a ramp; speeds are 0..=2047, and by PULSE_DIV become steps.
    VMin = 0x2,
    /// Speed limit.
    VMax = 0x3,
    /// Target velocity; written by the chip itself in ramp and soft mode.
    VTarget = 0x4,
    /// Actual velocity.
    VActual = 0x5,
    /// Acceleration limit.
    AMax = 0x6,
    /// Actual acceleration, smoothed.
    AActual = 0x7,
    /// PMUL in bits 15..8, PDIV in bits 3..0.
    PMulPDiv = 0x9,
    /// Reference switch configuration in bits 11..8, ramp mode in bits 1..0.
    RefConfMode = 0xA,
    /// Interrupt mask in bits 15..8, flags in bits 7..0.
    Interrupt = 0xB,
    /// PULSE_DIV in bits 15..12, RAMP_DIV in bits 11..8, USRS in bits 2..0.
    Divisors = 0xC,
    /// Tolerance around position zero in which the switches do not stop.
    DxRefTolerance = 0xD,
    /// Position latched at a switch; a write arms the latch.
    XLatched = 0xE,
}

/// Number of register indices of one ramp generator.
const REGISTERS: usize = 16;

/// Registers common to all three (datasheet section 8.2), by their index with SMDA = 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Common {
    /// Interface configuration, see [`interface`].
    InterfaceConfiguration = 0x4,
    /// Type and version: reads 0x429101.
    TypeVersion = 0x9,
    /// State of the six reference switches.
    ReferenceSwitches = 0xE,
    /// Stepper motor global parameters.
    GlobalParameters = 0xF,
}

/// Bits of the interface configuration register (datasheet section 8.2.4).
pub mod interface {
    /// Inverts all reference switch inputs.
    pub const INV_REF: u32 = 1 << 0;
    /// nINT_SDO_C is the non-inverting SDO while selected, tristate otherwise.
    pub const SDO_INT: u32 = 1 << 1;
    /// Inverts the direction outputs.
    pub const INV_DIR: u32 = 1 << 4;
    /// Step/direction outputs in place of the SPI driver chain.
    pub const EN_SD: u32 = 1 << 5;
    /// Enables the right reference switch inputs.
    pub const EN_REFR: u32 = 1 << 8;
}

/// Reference switch bits of [`Register::RefConfMode`] (datasheet section 8.1.11).
pub mod reference {
    /// The left switch does not stop the motor.
    pub const DISABLE_STOP_L: u32 = 1 << 8;
    /// The right switch does not stop the motor.
    pub const DISABLE_STOP_R: u32 = 1 << 9;
    /// Stop along the ramp, not at once.
    pub const SOFT_STOP: u32 = 1 << 10;
    /// The position is latched at the right switch, not at the left one.
    pub const REF_RNL: u32 = 1 << 11;
    /// Read only (lp): the latch is armed and has not latched a position yet.
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
    /// Running at a target velocity.
    Velocity = 2,
    /// Turning at the velocity that is written to V_ACTUAL, without a ramp.
    Hold = 3,
}

/// Reading of the type and version register (datasheet section 7.3).
const TYPE_VERSION: u32 = 0x42_9101;

/// Status bit: an interrupt is pending. All interrupts are masked, so the bit is set only where no chip drives the bus.
const STATUS_INT: u8 = 1 << 7;

const WORD: u32 = 0x00FF_FFFF;
const READ: u8 = 1;
const COMMON: u8 = 3;

/// Sign-extends the low `bits` of a register.
pub const fn signed(word: u32, bits: u32) -> i32 {
    ((word << (32 - bits)) as i32) >> (32 - bits)
}

/// The chip on its SPI bus.
#[derive(Debug)]
pub struct Tmc429<SPI> {
    spi: SPI,
    /// Status byte of the last datagram that was answered.
    status: u8,
    /// A datagram was not answered, and the chip has not been [confirmed](Self::confirm) to be there since.
    unanswered: bool,
    shadow: [[Option<u32>; REGISTERS]; 3],
    interface: Option<u32>,
}

impl<SPI: SpiDevice> Tmc429<SPI> {
    /// The chip with unknown register contents: after a warm start it may be running.
    pub const fn new(spi: SPI) -> Self {
        Tmc429 { spi, status: 0, unanswered: false, shadow: [[None; REGISTERS]; 3], interface: None }
    }

    /// Stops all motors at once, whatever they were doing: hold mode is the one in which V_ACTUAL may be
    /// written (datasheet section 8.1.6), and a written zero ends the motion with the next pulse. Interrupts are
    /// masked: another firmware may have left them on, and a pending one looks like a chip that does not answer.
    ///
    /// # Errors
    /// That of the first datagram that did not get through; the others go out all the same.
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

    /// Step/direction operation with right switches enabled, for all three motors.
    pub fn initialise(&mut self) -> Result<(), Error<SPI::Error>> {
        // LSMD = 2 (three motors), all else zero: step pulse of 16 clocks, 1 us at 16 MHz (datasheet
        // section 9, STPDIV_429 = 0).
        self.transfer(COMMON, Common::GlobalParameters as u8, Some(0x2))?;
        self.write_interface(false, false)
    }

    /// Inverts the switch inputs, or the direction outputs, of all three motors.
    pub fn write_interface(&mut self, invert_switches: bool, invert_direction: bool) -> Result<(), Error<SPI::Error>> {
        let mut word = interface::EN_REFR | interface::EN_SD | interface::SDO_INT;
        if invert_switches {
            word |= interface::INV_REF;
        }
        if invert_direction {
            word |= interface::INV_DIR;
        }
        if self.interface != Some(word) {
            self.interface = None;
            self.transfer(COMMON, Common::InterfaceConfiguration as u8, Some(word))?;
            self.interface = Some(word);
        }
        Ok(())
    }

    /// Writes a register of one motor, unless the chip has that value already.
    pub fn write(&mut self, generator: RampGenerator, register: Register, word: u32) -> Result<(), Error<SPI::Error>> {
        let word = word & WORD;
        // The chip changes these registers itself, or acts on each write: what they hold is not known afterwards.
        let lively = matches!(
            register,
            Register::XActual | Register::VActual | Register::VTarget | Register::Interrupt | Register::XLatched
        );
        if self.holds(generator, register, word) {
            return Ok(());
        }
        // The register's contents are known only if the datagram got through.
        let result = self.transfer(generator as u8, register as u8, Some(word));
        if let Some(known) = self.shadow.get_mut(generator as usize).and_then(|r| r.get_mut(register as usize)) {
            *known = if lively || result.is_err() { None } else { Some(word) };
        }
        result.map(drop)
    }

    /// True when the chip is known to hold `word` in this register.
    pub fn holds(&self, generator: RampGenerator, register: Register, word: u32) -> bool {
        let known = self.shadow.get(generator as usize).and_then(|r| r.get(register as usize));
        known.is_some_and(|known| *known == Some(word))
    }

    /// Reads a register of one motor: 24 bits.
    pub fn read(&mut self, generator: RampGenerator, register: Register) -> Result<u32, Error<SPI::Error>> {
        self.transfer(generator as u8, register as u8, None)
    }

    /// Reads the state of the six reference switches: bit 2n is the right switch of motor n, bit 2n + 1 its
    /// left one, polarity applied.
    pub fn reference_switches(&mut self) -> Result<u32, Error<SPI::Error>> {
        self.transfer(COMMON, Common::ReferenceSwitches as u8, None)
    }

    /// Asks the chip for its type and version: it is there and the bus works. A bus that reads nothing but zeros is
    /// noticed only by this.
    ///
    /// # Errors
    /// The chip did not answer with its version; until it does, all readings count as not answered.
    pub fn confirm(&mut self) -> Result<(), Error<SPI::Error>> {
        self.unanswered = false;
        let version = self.transfer(COMMON, Common::TypeVersion as u8, None)?;
        self.unanswered = version != TYPE_VERSION;
        if self.unanswered { Err(Error::NoAnswer) } else { Ok(()) }
    }

    /// True while all datagrams since the last [`confirm`](Self::confirm) were answered.
    pub const fn answers(&self) -> bool {
        !self.unanswered
    }

    /// Left reference switch active, as of the last datagram.
    pub const fn left_switch(&self, generator: RampGenerator) -> bool {
        self.status & (2 << (2 * generator as u8)) != 0
    }

    /// One datagram: SMDA and register index, then 24 bits to write, or zeros and the read bit. The answer's
    /// first byte is the status (datasheet section 6.2.2.2).
    fn transfer(&mut self, smda: u8, index: u8, write: Option<u32>) -> Result<u32, Error<SPI::Error>> {
        let [_, high, middle, low] = write.unwrap_or(0).to_be_bytes();
        let read = if write.is_none() { READ } else { 0 };
        let mut datagram = [smda << 5 | index << 1 | read, high, middle, low];
        self.spi.transfer_in_place(&mut datagram).map_err(Error::Spi)?;
        let [status, high, middle, low] = datagram;
        let lost = status & STATUS_INT != 0;
        self.unanswered |= lost;
        // A write may have reached the chip all the same; a reading may mean nothing.
        if lost || self.unanswered && write.is_none() {
            return Err(Error::NoAnswer);
        }
        self.status = status;
        Ok(u32::from_be_bytes([0, high, middle, low]))
    }
}
