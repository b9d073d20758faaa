//! The TMC429 as the motion controller of three axes.

use embedded_hal::spi::SpiDevice;

use super::generator::{CONFIRMATION, READINGS};
use crate::chip::tmc429::{RampGenerator, Tmc429};
use crate::motion::Error;
use crate::motion::hardware::MotionController;

impl<M: SpiDevice> MotionController for Tmc429<M> {
    const AXES: usize = RampGenerator::ALL.len();

    fn start(&mut self) -> Result<(), Error> {
        self.confirm()?;
        self.halt()?;
        Ok(self.initialise()?)
    }

    fn stop_all(&mut self) -> Result<(), Error> {
        Ok(self.halt()?)
    }

    fn is_there(&mut self) -> bool {
        self.answers() || self.confirm().is_ok()
    }

    fn invert(&mut self, switches: bool, direction: bool) -> Result<(), Error> {
        Ok(self.write_interface(switches, direction)?)
    }

    fn begin_turn(&mut self) {
        self.forget_switches();
    }

    fn is_of_motion(reading: u8) -> bool {
        let reading = reading % READINGS;
        reading != CONFIRMATION && reading % 4 != 1
    }
}
