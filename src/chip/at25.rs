//! Driver of the AT25 EEPROMs with addresses of 16 bits: the AT25128 with 16 384 bytes in pages of 64, and larger ones.
//! These have up to 65 536 bytes in pages of 64 or 128. A page is written within 5 ms (AT25128 datasheet).
//!
//! A write is only started here, and [`At25::busy`] tells when it is over; nothing waits but [`At25::settle`], which is
//! for the start of the firmware.

use embedded_hal::spi::{Operation, SpiDevice};

const WRITE: u8 = 0x02;
const READ: u8 = 0x03;
const READ_STATUS: u8 = 0x05;
const WRITE_ENABLE: u8 = 0x06;
/// Status bit: the part is writing.
const BUSY: u8 = 1 << 0;
/// Status bit: the part accepts a write command.
const WRITE_ENABLED: u8 = 1 << 1;

/// Number of status readings of [`At25::settle`]. One takes two bytes, 6.1 us at 2.625 MHz; all take 20 ms.
const SETTLE_READS: u32 = 3_300;

/// Why a write was not started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The SPI bus failed.
    Spi(E),
    /// The part does not answer as an EEPROM does, because it is missing, busy or locked.
    NotResponding,
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Error::Spi(error)
    }
}

/// The part on its SPI bus.
#[derive(Debug)]
pub struct At25<SPI> {
    spi: SPI,
}

impl<SPI: SpiDevice> At25<SPI> {
    /// The part on an SPI device in mode 0 or 3.
    pub const fn new(spi: SPI) -> Self {
        At25 { spi }
    }

    /// Reads bytes from `address` on.
    ///
    /// # Errors
    /// The error of the SPI bus.
    pub fn read(&mut self, address: u16, bytes: &mut [u8]) -> Result<(), SPI::Error> {
        let [high, low] = address.to_be_bytes();
        self.spi.transaction(&mut [Operation::Write(&[READ, high, low]), Operation::Read(bytes)])
    }

    /// Starts writing at an address. The bytes must not go beyond the end of a page. Afterwards the part is busy for up
    /// to 5 ms.
    ///
    /// # Errors
    /// [`Error::Spi`], or [`Error::NotResponding`]; then nothing is written.
    pub fn start_write(&mut self, address: u16, page: &[u8]) -> Result<(), Error<SPI::Error>> {
        self.spi.write(&[WRITE_ENABLE])?;
        // The status of a missing part reads as all ones; a locked part keeps the enable bit clear.
        if self.status()? & (WRITE_ENABLED | BUSY) != WRITE_ENABLED {
            return Err(Error::NotResponding);
        }
        let [high, low] = address.to_be_bytes();
        self.spi.transaction(&mut [Operation::Write(&[WRITE, high, low]), Operation::Write(page)])?;
        Ok(())
    }

    /// Waits for the end of a write during which the firmware was restarted: until then the part cannot be read. False
    /// if the part is still busy after about 20 ms, four times the duration of a write: then no part answers.
    ///
    /// # Errors
    /// The error of the SPI bus.
    pub fn settle(&mut self) -> Result<bool, SPI::Error> {
        for _ in 0..SETTLE_READS {
            if !self.busy()? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// True while the part is writing.
    ///
    /// # Errors
    /// The error of the SPI bus.
    pub fn busy(&mut self) -> Result<bool, SPI::Error> {
        Ok(self.status()? & BUSY != 0)
    }

    fn status(&mut self) -> Result<u8, SPI::Error> {
        let mut answer = [READ_STATUS, 0];
        self.spi.transfer_in_place(&mut answer)?;
        let [_, status] = answer;
        Ok(status)
    }
}
