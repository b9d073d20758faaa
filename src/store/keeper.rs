//! Carries out page writes on the EEPROM: started, waited for without blocking, read back and compared.

use embedded_hal::spi::SpiDevice;

use super::memory::LONGEST_PAGE;
use super::page::Job;
use super::{Memory, Report, Store};
use crate::chip::at25::At25;
use crate::units::Micros;

/// A page takes up to 5 ms; after four times that the part is taken for dead.
const PATIENCE: Micros = Micros::from_millis(20);

/// The EEPROM with at most one page on its way.
#[derive(Debug)]
pub struct Keeper<SPI> {
    part: At25<SPI>,
    /// The part answered at the start. If not, what was read from it was nothing, and nothing is written over
    /// settings that nobody has seen.
    readable: bool,
    writing: Option<(Job, Micros)>,
}

impl<SPI: SpiDevice> Keeper<SPI> {
    /// Takes charge of the part.
    pub const fn new(part: At25<SPI>) -> Self {
        Keeper { part, readable: false, writing: None }
    }

    /// Reads everything into the store, once a write that a restart has overtaken is over. If the part does not
    /// answer, defaults apply and all writes fail until the next restart.
    pub fn load<M: Memory>(&mut self, store: &mut Store<M>) -> Report {
        let loaded = match self.part.settle() {
            Ok(true) => store.load(|address, page| self.part.read(address, page)).ok(),
            Ok(false) | Err(_) => None,
        };
        self.readable = loaded.is_some();
        loaded.unwrap_or_else(|| store.unreachable())
    }

    /// Goes on with the page on its way, or takes the next one from `next`. Returns whether a page was
    /// written, once that is known. To be called about once a millisecond.
    pub fn poll(&mut self, now: Micros, next: impl FnOnce() -> Option<Job>) -> Option<bool> {
        match self.writing.take() {
            None => {
                let job = next()?;
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

    fn holds(&mut self, job: &Job) -> bool {
        let mut space = [0; LONGEST_PAGE];
        let page = space.get_mut(..job.page.len()).unwrap_or_default();
        self.part.read(job.address, page).is_ok() && *page == *job.page
    }
}
