//! Driver of the TMC262 stepper driver: five write-only registers in datagrams of 20 bits. Each datagram is answered by
//! one of three status words (TMC262 datasheet, chapter 6; application note AN016).
//!
//! The chip is written 24 bits at a time. Four leading zeros fall out of its shift register of 20 bits, and the answer
//! comes in the first 20 of the 24 bits.

use embedded_hal::spi::SpiDevice;

use super::error::Error;
use crate::units::CurrentScale;

/// The configuration of the chip, field by field of its registers (TMC262 datasheet, chapter 6), in the units of the
/// registers where nothing else is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Configuration {
    /// Microsteps per full step as a power of two, 0..=8: the chip's MRES counts the other way, 8 - n.
    pub microsteps: u8,
    /// INTPOL: each step pulse becomes 16 microsteps within the chip; the chip takes it at 16 microsteps only.
    pub interpolation: bool,
    /// DEDGE: both edges of the step input make a step.
    pub double_edge: bool,
    /// TBL, 0..=3: blank time after a switching of the bridges, in which the chip does not look at the coil current.
    pub blank_time: u8,
    /// CHM: chopper with constant off time in place of spreadCycle.
    pub constant_toff: bool,
    /// HDEC bit 1, with constant off time only: fast decay ends after its time alone, whatever the coil current is.
    pub no_fast_decay_comparator: bool,
    /// HDEC, 0..=3, in spreadCycle only: the hysteresis goes down by one each 16, 32, 48 or 64 clocks.
    pub hysteresis_decrement: u8,
    /// 0..=15: HEND in spreadCycle, where it is the end of the hysteresis; with constant off time the fast decay time.
    pub hysteresis_end: u8,
    /// 0..=8: HSTRT in spreadCycle, where it is the start of the hysteresis; with constant off time the sine wave
    /// offset.
    pub hysteresis_start: u8,
    /// TOFF, 0..=15: duration of the slow decay; 0 switches the bridges off.
    pub off_time: u8,
    /// RNDTF: the off time varies at random.
    pub random_off_time: bool,
    /// SEIMIN: coolStep goes down to 1/2 (0) or 1/4 (1) of the current scale.
    pub current_minimum: u8,
    /// SEDN, 0..=3: after 32, 8, 2 or 1 measurements above the upper threshold the current goes down by one.
    pub down_step: u8,
    /// SEMAX, 0..=15: distance of coolStep's upper threshold from its lower one, in 32 units of the load value.
    pub hysteresis: u8,
    /// SEUP, 0..=3: each measurement below the lower threshold raises the current by 1, 2, 4 or 8.
    pub up_step: u8,
    /// SEMIN, 0..=15: coolStep's lower threshold, in 32 units of the load value; 0 switches coolStep off.
    pub cool_step: u8,
    /// SFILT: a load value is measured over four full steps in place of one.
    pub filter: bool,
    /// SGT, -64..=63: the larger the threshold, the larger the load at which the load value becomes 0, a stall.
    pub threshold: i8,
    /// CS: current of the coils, 0..=31.
    pub current: CurrentScale,
    /// SLPH, 0..=3: slope of the gates of the high-side transistors.
    pub slope_high: u8,
    /// SLPL, 0..=3: slope of the gates of the low-side transistors.
    pub slope_low: u8,
    /// DISS2G: a short to ground does not switch the bridges off.
    pub no_short_protection: bool,
    /// TS2G, 0..=3: how long a short to ground must last before the bridges are switched off.
    pub short_timer: u8,
    /// VSENSE: full scale of the current is 165 mV at the sense resistor in place of 305 mV.
    pub vsense: bool,
}

/// The five registers, in the order of their addresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
enum Register {
    DrvCtrl = 0,
    ChopConf = 1,
    SmartEn = 2,
    SgcsConf = 3,
    DrvConf = 4,
}

const REGISTERS: usize = 5;

/// Marks contents of a register that are known, in a word of which the register has the low 20 bits.
const KNOWN: u32 = 1 << 31;

/// An answer that no chip gives: all its bits are set, also the two that are always zero.
const NO_ANSWER: u32 = 0xF_FFFF;

/// The reading that the next answer carries: the field RDSEL as last written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Readout {
    /// The position in the microstep table, which is the chip's choice at power-on.
    Position = 0,
    /// The stallGuard2 load value with all its ten bits.
    StallGuard = 1,
    /// The five high bits of the stallGuard2 load value, and the coolStep current.
    Current = 2,
}

/// The order in which [`Tmc262::refresh`] rewrites the registers. DRVCONF comes before each of the others and then
/// selects the other readout, so load value and current are each read within four refreshes.
const TURNS: [Register; 8] = [
    Register::DrvConf,
    Register::DrvCtrl,
    Register::DrvConf,
    Register::ChopConf,
    Register::DrvConf,
    Register::SmartEn,
    Register::DrvConf,
    Register::SgcsConf,
];

/// Flags in bits 7..0 of every answer, active high: those that mean that the driver has switched the bridges off.
pub mod flags {
    /// OT: the driver is shut down by over-temperature.
    pub const OVERTEMPERATURE: u8 = 1 << 1;
    /// S2GA: the driver is shut down by a short to ground at coil A.
    pub const SHORT_A: u8 = 1 << 3;
    /// S2GB: the driver is shut down by a short to ground at coil B.
    pub const SHORT_B: u8 = 1 << 4;
}

/// The chip on its SPI bus. Each datagram sets a register to a value, so one whose answer was lost may be repeated.
#[derive(Debug)]
pub struct Tmc262<SPI> {
    spi: SPI,
    /// The words that the registers are to have.
    words: [u32; REGISTERS],
    /// The words that the registers are known to have, with [`KNOWN`]; 0 where that is not known.
    written: [u32; REGISTERS],
    readout: Readout,
    /// Index in `TURNS` of the register that the next refresh rewrites.
    turn: usize,
    load: u16,
    current: u8,
    flags: u8,
}

impl<SPI: SpiDevice> Tmc262<SPI> {
    /// The chip on an SPI device in mode 3, with unknown register contents.
    pub const fn new(spi: SPI) -> Self {
        Tmc262 {
            spi,
            words: [0; REGISTERS],
            written: [0; REGISTERS],
            readout: Readout::Position,
            turn: 0,
            load: 0,
            current: 0,
            flags: 0,
        }
    }

    /// Gives the registers other words, by a configuration, which [`update`](Self::update) writes.
    pub fn configure(&mut self, configuration: &Configuration) {
        self.words = words(configuration);
    }

    /// Brings the chip to its configuration. Only registers that differ are written.
    ///
    /// # Errors
    /// A datagram did not get through; the register concerned is written by the next call.
    pub fn update(&mut self) -> Result<(), Error<SPI::Error>> {
        for register in
            [Register::DrvConf, Register::DrvCtrl, Register::ChopConf, Register::SmartEn, Register::SgcsConf]
        {
            if self.written[register as usize] != self.words[register as usize] | KNOWN {
                self.send(register)?;
            }
        }
        Ok(())
    }

    /// Forgets what the registers contain, as after a loss of supply: the next [`update`](Self::update) writes all of
    /// them.
    pub fn forget(&mut self) {
        self.written = [0; REGISTERS];
    }

    /// Rewrites one register in turn and takes in the reading that its answer carries. After eight calls a driver that
    /// lost its supply has all registers again.
    ///
    /// # Errors
    /// The datagram did not get through.
    pub fn refresh(&mut self) -> Result<(), Error<SPI::Error>> {
        let register = TURNS[self.turn % TURNS.len()];
        self.turn = (self.turn + 1) % TURNS.len();
        self.send(register)
    }

    /// The stallGuard2 load value as read last, 0..=1023; 0 is the largest load.
    pub const fn load(&self) -> u16 {
        self.load
    }

    /// The coolStep current as read last, 0..=31.
    pub const fn current(&self) -> u8 {
        self.current
    }

    /// The flags of the last answer, see [`flags`].
    pub const fn flags(&self) -> u8 {
        self.flags
    }

    /// Notes that the driver does not answer: it reads as all ones then, as if all flags were set.
    pub const fn note_silence(&mut self) {
        (self.load, self.current, self.flags) = (0x3FF, 0x1F, u8::MAX);
    }

    fn send(&mut self, register: Register) -> Result<(), Error<SPI::Error>> {
        let word = self.words[register as usize];
        self.written[register as usize] = 0;
        // Each DRVCONF selects the readout that the one before did not.
        let next = match (register, self.readout) {
            (Register::DrvConf, Readout::StallGuard) => Readout::Current,
            (Register::DrvConf, Readout::Position | Readout::Current) => Readout::StallGuard,
            (_, same) => same,
        };
        let sent = if register == Register::DrvConf { word | (next as u32) << 4 } else { word };
        let [_, high, middle, low] = sent.to_be_bytes();
        let mut datagram = [high, middle, low];
        self.spi.transfer_in_place(&mut datagram).map_err(Error::Spi)?;
        let [high, middle, low] = datagram;
        let answer = u32::from_be_bytes([0, high, middle, low]) >> 4;
        if answer == NO_ANSWER {
            // If it has arrived all the same, the next answer does not carry the reading that is noted.
            self.readout = Readout::Position;
            return Err(Error::NoAnswer);
        }
        self.take(answer);
        self.readout = next;
        self.written[register as usize] = word | KNOWN;
        Ok(())
    }

    fn take(&mut self, answer: u32) {
        let reading = answer >> 10 & 0x3FF;
        match self.readout {
            Readout::Position => {}
            Readout::StallGuard => self.load = reading as u16,
            Readout::Current => self.current = (reading & 0x1F) as u8,
        }
        self.flags = (answer & 0xFF) as u8;
    }
}

/// The register words of a configuration; RDSEL of DRVCONF is left zero.
fn words(c: &Configuration) -> [u32; REGISTERS] {
    let bit = |set: bool, n: u32| u32::from(set) << n;
    let field = |value: u8, n: u32| u32::from(value) << n;
    let drvctrl = bit(c.interpolation, 9) | bit(c.double_edge, 8) | field(8_u8.saturating_sub(c.microsteps), 0);
    // The two hysteresis fields change their meaning with the chopper mode. In spreadCycle they are HEND and HSTRT.
    // With constant off time the four bits of the fast decay time are HSTRT and, as the highest, bit 11, and HEND holds
    // the sine wave offset. HDEC is bits 12 and 11 in spreadCycle.
    let (hend, hstrt, hdec) = if c.constant_toff {
        (
            c.hysteresis_start,
            c.hysteresis_end & 7,
            bit(c.no_fast_decay_comparator, 12) | field(c.hysteresis_end >> 3, 11),
        )
    } else {
        // HSTRT has three bits: a start of 8 is its largest value.
        (c.hysteresis_end, c.hysteresis_start.min(7), field(c.hysteresis_decrement, 11))
    };
    let chopconf = 0b100 << 17
        | field(c.blank_time, 15)
        | bit(c.constant_toff, 14)
        | bit(c.random_off_time, 13)
        | hdec
        | field(hend, 7)
        | field(hstrt, 4)
        | field(c.off_time, 0);
    // The upper coolStep threshold is (SEMIN + SEMAX + 1) * 32: the distance between the two is SEMAX as it is.
    let smarten = 0b101 << 17
        | field(c.current_minimum, 15)
        | field(c.down_step, 13)
        | field(c.hysteresis, 8)
        | field(c.up_step, 5)
        | field(c.cool_step, 0);
    let sgcsconf = 0b110 << 17 | bit(c.filter, 16) | (c.threshold as u32 & 0x7F) << 8 | c.current.bits();
    let drvconf = 0b111 << 17
        | field(c.slope_high, 14)
        | field(c.slope_low, 12)
        | bit(c.no_short_protection, 10)
        | field(c.short_timer, 8)
        | bit(c.vsense, 6);
    [drvctrl, chopconf, smarten, sgcsconf, drvconf]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn defaults() -> Configuration {
        Configuration {
            microsteps: 8,
            interpolation: false,
            double_edge: false,
            blank_time: 2,
            constant_toff: false,
            no_fast_decay_comparator: false,
            hysteresis_decrement: 0,
            hysteresis_end: 2,
            hysteresis_start: 3,
            off_time: 5,
            random_off_time: false,
            current_minimum: 0,
            down_step: 0,
            hysteresis: 0,
            up_step: 0,
            cool_step: 0,
            filter: true,
            threshold: 5,
            current: CurrentScale::from_parameter(40),
            slope_high: 3,
            slope_low: 3,
            no_short_protection: false,
            short_timer: 0,
            vsense: true,
        }
    }

    /// The words that the vendor's open firmware for the sibling module writes after reset: DRVCTRL 00000, CHOPCONF
    /// 90135, SMARTEN A0000, SGCSCONF D0505, and DRVCONF EF060, of which 00020 is RDSEL 2.
    #[test]
    fn words_of_the_sibling_firmware() {
        assert_eq!(words(&defaults()), [0x00000, 0x90135, 0xA0000, 0xD0505, 0xEF040]);
    }

    /// Bits 12 and 11 of CHOPCONF.
    #[test]
    fn the_hysteresis_decrement_is_that_of_spread_cycle() {
        let decrement = |hysteresis_decrement| words(&Configuration { hysteresis_decrement, ..defaults() })[1];
        assert_eq!([0, 1, 2, 3].map(decrement), [0x90135, 0x90935, 0x91135, 0x91935]);
    }

    #[test]
    fn constant_off_time_moves_the_fields() {
        let c = Configuration {
            constant_toff: true,
            no_fast_decay_comparator: true,
            hysteresis_decrement: 3,
            hysteresis_end: 0b1010,
            hysteresis_start: 8,
            ..defaults()
        };
        // TBL 2 -> bit 16; CHM bit 14; bit 12 and the decay time's bit 3 in bit 11; HEND 8 -> bit 10;
        // HSTRT 2 -> bit 5; TOFF 5.
        assert_eq!(words(&c)[1], 0x80000 | 1 << 16 | 1 << 14 | 1 << 12 | 1 << 11 | 1 << 10 | 1 << 5 | 5);
    }

    #[test]
    fn microsteps_current_and_threshold() {
        let c = Configuration {
            microsteps: 0,
            hysteresis_start: 8,
            threshold: -64,
            current: CurrentScale::from_parameter(255),
            ..defaults()
        };
        let [drvctrl, chopconf, _, sgcsconf, _] = words(&c);
        assert_eq!(drvctrl, 8);
        assert_eq!(chopconf >> 4 & 7, 7);
        assert_eq!(sgcsconf, 0xC0000 | 1 << 16 | 0x40 << 8 | 31);
    }
}
