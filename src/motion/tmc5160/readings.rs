//! What is read of a TMC5160 and of its motor, and what is made of it.

use embedded_hal::spi::SpiDevice;

use super::Tmc5160Axis;
use super::unit::signed_speed;
use crate::chip::tmc5160::{Register, Tmc5160, enc_status, ramp_stat};
use crate::motion::Error;

/// A difference between two readings of the position, in microsteps, after which the chip is asked whether it is there: at
/// its top speed of 7 999 512 pps a motor makes 8000 in a millisecond.
pub(super) const LEAP: u32 = 1 << 14;

/// Number of turns in a rotation of readings.
pub(super) const ROTATION: u8 = 32;

impl<D: SpiDevice> Tmc5160Axis<D> {
    /// The register for which this turn asks: the speed in one of two turns, else in rotation the states of driver, ramp and
    /// encoder, and now and then the version of the chip. Where a stall may have stopped the motor, the state of the ramp
    /// takes the place of the driver's.
    pub(super) fn next_reading(&mut self, chip: &Tmc5160<D>) -> Register {
        self.rotation = self.rotation.wrapping_add(1);
        match self.rotation % ROTATION {
            n if n % 2 == 0 => Register::VActual,
            n if n % 4 == 1 && !(self.armed && chip.is_stalled()) => Register::DrvStatus,
            31 => Register::Ioin,
            n if n % 8 == 7 => Register::EncStatus,
            _ => Register::RampStat,
        }
    }

    /// True if the motor stands where it is to stand, by readings that are younger than its goal.
    pub(super) fn rests(&self) -> bool {
        self.settling == 0 && self.known.speed == 0 && self.known.ahead() == 0
    }

    /// Takes in a reading of the position. A chip without supply reads as zeros, and one that has been reset has lost its
    /// position: then the motor is where it was last known to be.
    pub(super) fn take_position(&mut self, chip: &mut Tmc5160<D>, position: i32) -> Result<(), Error> {
        let way = position.wrapping_sub(self.known.position).unsigned_abs();
        if (way > LEAP || position == 0 && way > 0) && !chip.is_lost() {
            chip.confirm()?;
        }
        if !chip.is_lost() {
            self.known.position = position;
        }
        Ok(())
    }

    /// Takes in a reading of the rotation.
    pub(super) fn take(&mut self, chip: &mut Tmc5160<D>, register: Register, word: u32) -> Result<(), Error> {
        match register {
            Register::VActual => self.known.speed = self.unit.of_register(signed_speed(word)),
            Register::DrvStatus => self.driver = word,
            Register::RampStat => self.stalled = self.armed && word & ramp_stat::EVENT_STOP_SG != 0,
            Register::EncStatus => {
                self.deviates = word & enc_status::DEVIATION_WARN != 0;
                if self.deviates {
                    // The flag stays until it is cleared, and does not go while the encoder deviates.
                    chip.write(Register::EncStatus, enc_status::DEVIATION_WARN)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Forgets that the encoder deviated, also in a reading that is under way.
    pub(super) fn forget_deviation(&mut self, chip: &mut Tmc5160<D>) -> Result<(), Error> {
        chip.write(Register::EncStatus, enc_status::DEVIATION_WARN)?;
        chip.drop_reading();
        self.deviates = false;
        Ok(())
    }
}
