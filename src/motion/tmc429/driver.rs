//! The TMC262 driver of an axis.

use embedded_hal::spi::{ErrorType, SpiDevice};

use super::Bound;
use super::configuration::configuration;
use crate::chip::error;
use crate::chip::tmc262::Tmc262;
use crate::motion::Error;
use crate::motion::current::Excitation;
use crate::motion::hardware::Driver;
use crate::motion::values::Values;

/// A function of the driver that exchanges datagrams.
type TellDriver<D> = fn(&mut Tmc262<D>) -> Result<(), error::Error<<D as ErrorType>::Error>>;

impl<M: SpiDevice, D: SpiDevice> Driver for Bound<'_, M, D> {
    fn drive(&mut self, values: &Values, excitation: Excitation) -> Result<(), Error> {
        self.axis.driver.configure(&configuration(values, excitation));
        self.tell_driver(Tmc262::update);
        Ok(())
    }

    fn forget(&mut self) {
        self.axis.driver.forget();
    }

    /// `pin` is the level of SG_TST, which is high while the load value is zero.
    fn stalled(&self, pin: bool) -> bool {
        pin
    }
}

impl<M: SpiDevice, D: SpiDevice> Bound<'_, M, D> {
    /// Exchanges datagrams with the driver, again if an answer is lost. A driver that does not answer then, while the
    /// TMC429 on the same bus does, counts as shut down. What has not reached it comes with its next readings, in whose
    /// rotation all its registers are written. Never inlined, for the size of it.
    #[inline(never)]
    pub(super) fn tell_driver(&mut self, tell: TellDriver<D>) {
        let is_silent = tell(&mut self.axis.driver).is_err() && tell(&mut self.axis.driver).is_err();
        if is_silent && self.chip.confirm().is_ok() && tell(&mut self.axis.driver).is_err() {
            self.axis.driver.note_silence();
        }
    }
}
