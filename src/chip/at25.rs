//! Driver of the AT25 EEPROMs with addresses of 16 bits: the AT25128 has 16 384 bytes in pages of 64, larger ones up to 65 536
//! in pages of 64 or 128. A page is written within 5 ms (AT25128 datasheet).
//!
//! A write is started, and [`At25::busy`] tells when it is over; only [`At25::settle`], for the start of the
//! firmware, waits.

use embedded_hal::spi::{Operation, SpiDevice};

const WRITE: u8 = 0x02;
const READ: u8 = 0x03;
const READ_STATUS: u8 = 0x05;
const WRITE_ENABLE: u8 = 0x06;
/// Status bit: a write is going on.
const BUSY: u8 = 1 << 0;
/// Status bit: writing is enabled.
const WRITE_ENABLED: u8 = 1 << 1;

/// Reading the status takes two bytes, 6.1 us at 2.6 MHz: 20 ms in all.
const SETTLE_READS: u32 = 3_300;

/// Why the part cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus failed.
    Spi(E),
    /// The part does not answer as an EEPROM does: missing, or locked.
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
    /// The part.
    pub const fn new(spi: SPI) -> Self {
        At25 { spi }
    }

    /// Reads from `address` on.
    pub fn read(&mut self, address: u16, bytes: &mut [u8]) -> Result<(), SPI::Error> {
        let [high, low] = address.to_be_bytes();
        self.spi.transaction(&mut [Operation::Write(&[READ, high, low]), Operation::Read(bytes)])
    }

    /// Starts writing at an address; the bytes do not go beyond the end of a page. The part is busy for up to 5 ms afterwards.
    pub fn start_write(&mut self, address: u16, page: &[u8]) -> Result<(), Error<SPI::Error>> {
        self.spi.write(&[WRITE_ENABLE])?;
        // A part that is absent reads as all ones, one that is locked keeps the enable bit clear.
        if self.status()? & (WRITE_ENABLED | BUSY) != WRITE_ENABLED {
            return Err(Error::NotResponding);
        }
        let [high, low] = address.to_be_bytes();
        self.spi.transaction(&mut [Operation::Write(&[WRITE, high, low]), Operation::Write(page)])?;
        Ok(())
    }

    /// Waits for the end of a write that a restart of the firmware has overtaken: until then the part can
    /// not be read. False if that takes longer than about 20 ms, four times the duration of a write: then there is
    /// no part that answers.
    pub fn settle(&mut self) -> Result<bool, SPI::Error> {
        for _ in 0..SETTLE_READS {
            if !self.busy()? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// True while a write is going on.
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
