//! Carries out the store's page writes on the EEPROM. A write is started, its end is polled for instead of waited for,
//! and then the page is read back and compared.

use embedded_hal::spi::SpiDevice;

use super::memory::{LONGEST_PAGE, Storing};
use super::page::Job;
use super::{LoadReport, Memory, Store};
use crate::chip::at25::At25;
use crate::units::Micros;

/// The datasheet allows 5 ms for a page write; an EEPROM that is busy for four times as long counts as dead.
const PATIENCE: Micros = Micros::from_millis(20);

/// The value that an erased byte reads, and one that no part drives.
const ERASED: u8 = 0xFF;

/// The EEPROM, with at most one page being written.
#[derive(Debug)]
pub struct Keeper<SPI> {
    part: At25<SPI>,
    /// The EEPROM answered at start-up. If it did not, its settings are unknown and must not be overwritten.
    readable: bool,
    /// The page being written, and when its write began.
    writing: Option<(Job, Micros)>,
}

impl<SPI: SpiDevice> Keeper<SPI> {
    /// A keeper of the EEPROM `part`, before [`Keeper::load`].
    pub const fn new(part: At25<SPI>) -> Self {
        Keeper { part, readable: false, writing: None }
    }

    /// Reads the EEPROM into the store, after a page write that a restart has cut off from the firmware has ended. If
    /// the EEPROM does not answer, factory defaults apply and all writes fail until the next restart.
    pub fn load<M: Memory>(&mut self, store: &mut Store<M>) -> LoadReport {
        let loaded = match self.part.settle() {
            Ok(true) => store.load(|address, page| self.read::<M>(address, page)).ok(),
            Ok(false) | Err(_) => None,
        };
        self.readable = loaded.is_some();
        loaded.unwrap_or_else(|| store.unreachable())
    }

    /// Reads a page. An erased page may stand for defaults that must not come into force by mistake. There an EEPROM
    /// that has fallen silent is told from an erased page: it has no status.
    fn read<M: Memory>(&mut self, address: u16, page: &mut [u8]) -> Result<(), ()> {
        self.part.read(address, page).map_err(drop)?;
        let doubtful = matches!(M::LAYOUT.storing, Storing::Epochs { .. }) && page.iter().all(|byte| *byte == ERASED);
        if doubtful && !matches!(self.part.busy(), Ok(false)) { Err(()) } else { Ok(()) }
    }

    /// Checks on the page being written, or starts to write the one that `next` gives; to be called about once a
    /// millisecond. Returns true when a page is durable, false when it could not be written, `None` as long as neither
    /// is known.
    pub fn poll(&mut self, now: Micros, next: impl FnOnce() -> Option<Job>) -> Option<bool> {
        match self.writing.take() {
            None => {
                let job = next()?;
                // A page without bytes asks whether the EEPROM answers.
                if job.page.is_empty() {
                    return Some(matches!(self.part.busy(), Ok(false)));
                }
                if !self.readable || self.part.start_write(job.address, &job.page).is_err() {
                    return Some(false);
                }
                self.writing = Some((job, now));
                None
            }
            Some((job, since)) => match self.part.busy() {
                Ok(true) if now.since(since) < PATIENCE => {
                    self.writing = Some((job, since));
                    None
                }
                Ok(false) => Some(self.holds(&job)),
                Ok(true) | Err(_) => Some(false),
            },
        }
    }

    /// True when the EEPROM reads back as the page that was written.
    fn holds(&mut self, job: &Job) -> bool {
        let mut space = [0; LONGEST_PAGE];
        let page = space.get_mut(..job.page.len()).unwrap_or_default();
        self.part.read(job.address, page).is_ok() && *page == *job.page
    }
}
