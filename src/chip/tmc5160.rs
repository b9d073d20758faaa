//! Driver of the TMC5160, a ramp generator and a stepper driver in one chip, behind datagrams of 40 bits (TMC5160
//! datasheet, chapters 4 and 6).
//!
//! The word that is read from a register comes with the datagram after the one that asks for it. So a reading costs two
//! datagrams, but of several readings in a row each costs one: [`Tmc5160::turn`] makes use of that. Registers that only
//! the firmware changes are shadowed: writing a value that the chip already has costs no datagram. Every datagram
//! brings the chip's status byte along; the last one is kept. Datagrams whose answers are lost are repeated at once
//! where that does no harm, up to twice; and what a lost answer would have brought is asked for again.

mod register;

use embedded_hal::spi::SpiDevice;

use super::REPEATS;
use super::error::Error;

pub use register::{RampMode, Register, drv_status, enc_status, gconf, gstat, ramp_stat, sw_mode};

/// Frequency of the clock at the chip's pin CLK, in Hz. It is what all speeds, accelerations and times of the chip are
/// counted in.
pub const CLOCK: u32 = 16_000_000;

/// The bit of the address byte that makes a datagram a write.
const WRITE: u8 = 1 << 7;
/// The version in bits 31..24 of [`Register::Ioin`].
const VERSION: u32 = 0x30;

/// Bits of the status byte.
mod status {
    /// reset_flag: the chip has been reset.
    pub(super) const RESET: u8 = 1 << 0;
    /// sg2: a stall.
    pub(super) const STALL: u8 = 1 << 2;
    /// status_stop_l: the left switch is closed.
    pub(super) const STOP_L: u8 = 1 << 6;
    /// status_stop_r: the right switch is closed.
    pub(super) const STOP_R: u8 = 1 << 7;
}

/// The registers that only the firmware changes: they are shadowed.
const SHADOWED: [Register; 26] = [
    Register::Gconf,
    Register::GlobalScaler,
    Register::IholdIrun,
    Register::TPowerDown,
    Register::TPwmThrs,
    Register::TCoolThrs,
    Register::THigh,
    Register::RampMode,
    Register::VStart,
    Register::A1,
    Register::V1,
    Register::AMax,
    Register::VMax,
    Register::DMax,
    Register::D1,
    Register::VStop,
    Register::TZeroWait,
    Register::VdcMin,
    Register::SwMode,
    Register::EncMode,
    Register::EncConst,
    Register::EncDeviation,
    Register::ChopConf,
    Register::CoolConf,
    Register::DcCtrl,
    Register::PwmConf,
];

/// The place of each register in the shadow, by address; the length of the shadow for those that have none.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects)]
const PLACES: [u8; 128] = {
    let mut places = [SHADOWED.len() as u8; 128];
    let mut place = 0;
    while place < SHADOWED.len() {
        places[SHADOWED[place] as usize] = place as u8;
        place += 1;
    }
    places
};

/// The readings of [`Tmc5160::turn`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// The actual position, in microsteps.
    pub position: i32,
    /// The word of a register for which an earlier call has asked.
    pub reading: Option<(Register, u32)>,
}

/// The chip on its SPI bus.
#[derive(Debug)]
pub struct Tmc5160<SPI> {
    spi: SPI,
    /// Status byte of the last datagram.
    status: u8,
    /// The register for which the last datagram has asked; `None` also after a lost answer, because that datagram may
    /// not have arrived.
    asked: Option<Register>,
    /// The register for which [`turn`](Self::turn) has asked, while no datagram has brought the answer.
    awaited: Option<Register>,
    /// A reading that has come, and that nobody has taken yet.
    reading: Option<(Register, u32)>,
    /// The chip has not answered as a TMC5160 does, also not when it was asked again, and has not been
    /// [confirmed](Self::confirm) since.
    unanswered: bool,
    /// The chip has told of a reset, and has not been [set up](Self::initialise) since.
    lost: bool,
    /// The registers whose contents are known, by their places in the shadow.
    known: u32,
    shadow: [u32; SHADOWED.len()],
}

impl<SPI: SpiDevice> Tmc5160<SPI> {
    /// The chip on an SPI device in mode 3, with unknown register contents: after a warm start its motor may be
    /// running.
    pub const fn new(spi: SPI) -> Self {
        Tmc5160 {
            spi,
            status: 0,
            asked: None,
            awaited: None,
            reading: None,
            unanswered: false,
            lost: false,
            known: 0,
            shadow: [0; SHADOWED.len()],
        }
    }

    /// Notes the end of whatever reset the chip: from now on its registers count as set up anew.
    ///
    /// # Errors
    /// A datagram did not get through, or the chip does not answer as a TMC5160 does.
    pub fn initialise(&mut self) -> Result<(), Error<SPI::Error>> {
        self.confirm()?;
        self.known = 0;
        self.write(Register::Gstat, gstat::RESET | gstat::DRV_ERR)?;
        self.write(Register::GlobalScaler, 0)?;
        // The status byte of a datagram is older than what the datagram before it has done.
        self.confirm()?;
        self.lost = false;
        Ok(())
    }

    /// Stops the motor at once, whatever it was doing. The speed cannot be written, but both switches stop the motor
    /// without a ramp where both count as closed: their polarities are set so (datasheet section 12.2.4, option d).
    /// What switches do is to be written anew when the motor stands.
    ///
    /// # Errors
    /// A datagram did not get through.
    pub fn halt(&mut self) -> Result<(), Error<SPI::Error>> {
        self.write(Register::VMax, 0)?;
        if !self.turns() {
            self.write(Register::RampMode, RampMode::Positive as u32)?;
        }
        let both = sw_mode::STOP_L_ENABLE | sw_mode::STOP_R_ENABLE;
        self.write(Register::SwMode, both)?;
        let closed = self.read(Register::RampStat)?;
        let bit = |closed_bit: u32, polarity: u32| if closed & closed_bit == 0 { polarity } else { 0 };
        let polarities = bit(ramp_stat::STOP_L, sw_mode::POL_STOP_L) | bit(ramp_stat::STOP_R, sw_mode::POL_STOP_R);
        self.write(Register::SwMode, both | polarities)
    }

    /// True if the ramp generator is known to be in one of the two velocity modes.
    fn turns(&self) -> bool {
        self.holds(Register::RampMode, RampMode::Positive as u32)
            || self.holds(Register::RampMode, RampMode::Negative as u32)
    }

    /// Writes to a register, unless it is known to have that value.
    ///
    /// # Errors
    /// The datagram did not get through; then the register's contents count as unknown.
    pub fn write(&mut self, register: Register, word: u32) -> Result<(), Error<SPI::Error>> {
        self.write_repeating(register, word, register.repeats())
    }

    /// Writes to one of the two registers that count, X_ACTUAL and X_ENC, while the motor stands: then nothing is lost
    /// by a second write.
    ///
    /// # Errors
    /// The datagram did not get through; the chip may have the position all the same.
    pub fn place_standing(&mut self, register: Register, position: i32) -> Result<(), Error<SPI::Error>> {
        self.write_repeating(register, position as u32, REPEATS)
    }

    fn write_repeating(&mut self, register: Register, word: u32, repeats: u8) -> Result<(), Error<SPI::Error>> {
        if self.holds(register, word) {
            return Ok(());
        }
        let bit = self.bit(register);
        self.known &= !bit;
        self.repeat(repeats, |chip| chip.exchange(register, Some(word)))?;
        if let Some(shadow) = self.shadow.get_mut(place(register)) {
            *shadow = word;
            self.known |= bit;
        }
        Ok(())
    }

    /// True when the chip is known to hold `word` in this register.
    pub fn holds(&self, register: Register, word: u32) -> bool {
        self.known & self.bit(register) != 0 && self.shadow.get(place(register)) == Some(&word)
    }

    /// Notes that the contents of all registers are unknown.
    pub const fn forget(&mut self) {
        self.known = 0;
    }

    /// Reads a register, with two datagrams.
    ///
    /// # Errors
    /// A datagram did not get through, or the chip has not been [confirmed](Self::confirm) since it once did not
    /// answer.
    pub fn read(&mut self, register: Register) -> Result<u32, Error<SPI::Error>> {
        self.read_repeating(register, REPEATS)
    }

    fn read_repeating(&mut self, register: Register, repeats: u8) -> Result<u32, Error<SPI::Error>> {
        let word = self.repeat(repeats, |chip| {
            chip.exchange(register, None)?;
            let reading = chip.reading;
            let word = chip.exchange(register, None);
            // The second datagram has asked once more, for an answer that nobody waits for.
            (chip.reading, chip.asked) = (reading, None);
            word
        })?;
        if self.unanswered { Err(Error::NoAnswer) } else { Ok(word) }
    }

    /// Reads the actual position and asks for the register `next`, with two datagrams.
    ///
    /// # Errors
    /// As of [`read`](Self::read).
    pub fn turn(&mut self, next: Register) -> Result<Turn, Error<SPI::Error>> {
        let position = self.repeat(REPEATS, |chip| {
            // Its answer was lost.
            if let Some(register) = chip.awaited.filter(|_| chip.asked.is_none()) {
                chip.exchange(register, None)?;
            }
            chip.exchange(Register::XActual, None)?;
            let reading = chip.reading;
            let position = chip.exchange(next, None);
            chip.reading = reading;
            position
        });
        let reading = self.reading.take();
        let position = position?;
        self.awaited = Some(next);
        if let Some((Register::Ioin, word)) = reading {
            self.unanswered |= version(word) != VERSION;
        }
        if self.unanswered { Err(Error::NoAnswer) } else { Ok(Turn { position: position as i32, reading }) }
    }

    /// Drops what has come of a register and was not taken yet: it is older than what was written since.
    pub const fn drop_reading(&mut self) {
        (self.reading, self.awaited) = (None, None);
    }

    /// Asks the chip for its version, which shows that chip and bus work.
    ///
    /// # Errors
    /// The chip did not answer with its version. Until it does, no reading counts as answered.
    pub fn confirm(&mut self) -> Result<(), Error<SPI::Error>> {
        // One that has not answered is asked once.
        let repeats = if core::mem::take(&mut self.unanswered) { 0 } else { REPEATS };
        let word = self.read_repeating(Register::Ioin, repeats)?;
        self.unanswered = version(word) != VERSION;
        if self.unanswered { Err(Error::NoAnswer) } else { Ok(()) }
    }

    /// True while the chip has answered as a TMC5160 does since the last [`confirm`](Self::confirm).
    pub const fn answers(&self) -> bool {
        !self.unanswered
    }

    /// True if the chip has been reset, by its supply, and so has lost its registers and the motor's position.
    pub const fn is_lost(&self) -> bool {
        self.lost
    }

    /// The stop switches at the last datagram, left and right, true is closed; after polarity and swap.
    pub const fn switches(&self) -> [bool; 2] {
        [self.status & status::STOP_L != 0, self.status & status::STOP_R != 0]
    }

    /// True if the driver had told of a stall at the last datagram.
    pub const fn is_stalled(&self) -> bool {
        self.status & status::STALL != 0
    }

    /// The bit of a register in [`known`](Self::known); 0 for a register that is not shadowed.
    fn bit(&self, register: Register) -> u32 {
        if place(register) < SHADOWED.len() { 1_u32.unbounded_shl(place(register) as u32) } else { 0 }
    }

    /// Exchanges datagrams, and if an answer is lost all of them again, up to `repeats` times. None is repeated with a
    /// chip that has not been confirmed since it did not answer.
    fn repeat<R>(
        &mut self,
        repeats: u8,
        exchange: impl Fn(&mut Self) -> Result<R, Error<SPI::Error>>,
    ) -> Result<R, Error<SPI::Error>> {
        for _ in 0..if self.unanswered { 0 } else { repeats } {
            match exchange(self) {
                Err(Error::NoAnswer) => {}
                result => return result,
            }
        }
        let result = exchange(self);
        self.unanswered |= matches!(result, Err(Error::NoAnswer));
        result
    }

    /// Exchanges one datagram: an address, and then 32 bits to be written, or zeros. The first byte of the answer is
    /// the status, the others are what the datagram before has asked for.
    fn exchange(&mut self, register: Register, write: Option<u32>) -> Result<u32, Error<SPI::Error>> {
        let [a, b, c, d] = write.unwrap_or(0).to_be_bytes();
        let address = register as u8 | if write.is_some() { WRITE } else { 0 };
        let mut datagram = [address, a, b, c, d];
        let asked = core::mem::replace(&mut self.asked, if write.is_some() { None } else { Some(register) });
        self.spi.transfer_in_place(&mut datagram).map_err(Error::Spi)?;
        let [status, a, b, c, d] = datagram;
        // All flags at once, at rest and stalled, reset and at both switches: no chip, but a line that stays high.
        if status == u8::MAX {
            self.asked = None;
            return Err(Error::NoAnswer);
        }
        let word = u32::from_be_bytes([a, b, c, d]);
        self.status = status;
        self.lost |= status & status::RESET != 0;
        if let Some(asked) = asked {
            self.awaited.take_if(|awaited| *awaited == asked);
            self.reading = Some((asked, word));
        }
        Ok(word)
    }
}

/// The place of a register in the shadow; beyond its end for one that is not shadowed.
fn place(register: Register) -> usize {
    PLACES.get(register as usize).copied().unwrap_or(u8::MAX).into()
}

/// The version in a reading of [`Register::Ioin`].
const fn version(word: u32) -> u32 {
    word >> 24
}
