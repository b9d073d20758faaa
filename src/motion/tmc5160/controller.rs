//! The TMC5160 as the motion controller of one axis.

use embedded_hal::spi::SpiDevice;

use crate::chip::tmc5160::Tmc5160;
use crate::motion::Error;
use crate::motion::hardware::MotionController;

impl<D: SpiDevice> MotionController for Tmc5160<D> {
    const AXES: usize = 1;

    fn start(&mut self) -> Result<(), Error> {
        self.initialise()?;
        Ok(self.halt()?)
    }

    fn stop_all(&mut self) -> Result<(), Error> {
        self.forget();
        Ok(self.halt()?)
    }

    fn is_there(&mut self) -> bool {
        self.answers() || self.confirm().is_ok()
    }

    /// Each chip inverts its switches and its motor by parameters of its axis (24, 25 and 251), so there is nothing
    /// that its axes have in common.
    fn invert(&mut self, _: bool, _: bool) -> Result<(), Error> {
        Ok(())
    }

    /// Stop switches come with each datagram.
    fn begin_turn(&mut self) {}

    /// No reading but those of [`follow`](crate::motion::RampGenerator::follow) is ever asked for.
    fn is_of_motion(_: u8) -> bool {
        false
    }
}
