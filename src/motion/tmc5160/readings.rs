//! The readings of a TMC5160 and of its motor, and their meaning.

use embedded_hal::spi::SpiDevice;

use super::unit::signed_speed;
use super::{Bound, Tmc5160Axis};
use crate::chip::tmc5160::{Register, Tmc5160, drv_status, enc_status, ramp_stat};
use crate::motion::Error;
use crate::motion::hardware::Readings;

/// A difference between two readings of the position, in microsteps, after which the chip is asked whether it is there.
/// At its top speed of 7 999 512 pps a motor makes 8000 in a millisecond.
pub(super) const LEAP: u32 = 1 << 14;

/// Number of turns in a rotation of readings.
pub(super) const ROTATION: u8 = 32;

impl<D: SpiDevice> Bound<'_, D> {
    /// The register for which this turn asks. It is the speed in one of two turns, else in rotation the states of
    /// driver, ramp and encoder, and now and then the version of the chip. Where a stall may have stopped the motor,
    /// the state of the ramp takes the place of the driver's.
    pub(super) fn next_reading(&mut self) -> Register {
        self.axis.rotation = self.axis.rotation.wrapping_add(1);
        match self.axis.rotation % ROTATION {
            n if n % 2 == 0 => Register::VActual,
            n if n % 4 == 1 && !(self.axis.stall.armed && self.chip.is_stalled()) => Register::DrvStatus,
            31 => Register::Ioin,
            n if n % 8 == 7 => Register::EncStatus,
            _ => Register::RampStat,
        }
    }

    /// Takes in a reading of the position. A chip without supply reads as zeros, and one that has been reset has lost
    /// its position: then the motor is where it was last known to be.
    pub(super) fn take_position(&mut self, position: i32) -> Result<(), Error> {
        let way = position.wrapping_sub(self.axis.known.position).unsigned_abs();
        if (way > LEAP || position == 0 && way > 0) && !self.chip.is_lost() {
            self.chip.confirm()?;
        }
        if !self.chip.is_lost() {
            self.axis.known.position = position;
        }
        Ok(())
    }

    /// Takes in a reading of the rotation.
    pub(super) fn take(&mut self, register: Register, word: u32) -> Result<(), Error> {
        match register {
            Register::VActual => self.axis.known.speed = self.axis.unit.of_register(signed_speed(word)),
            Register::DrvStatus => self.axis.driver = word,
            Register::RampStat => {
                self.axis.stall.stopped = self.axis.stall.armed && word & ramp_stat::EVENT_STOP_SG != 0
            }
            Register::EncStatus => {
                self.axis.deviates = word & enc_status::DEVIATION_WARN != 0;
                if self.axis.deviates {
                    // The flag stays until it is cleared, and does not go while the encoder deviates.
                    self.chip.write(Register::EncStatus, enc_status::DEVIATION_WARN)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Forgets that the encoder deviated, also in a reading that is under way.
    pub(super) fn forget_deviation(&mut self) -> Result<(), Error> {
        self.chip.write(Register::EncStatus, enc_status::DEVIATION_WARN)?;
        self.chip.drop_reading();
        self.axis.deviates = false;
        Ok(())
    }
}

/// The flags that mean that the driver has switched the motor off.
const SHUT_DOWN: u32 = flags::OVERTEMPERATURE | flags::SHORTS_TO_GROUND | flags::SHORTS_TO_SUPPLY;

impl<D: SpiDevice> Tmc5160Axis<D> {
    /// The last readings. While those of the driver may be older than its last release, a shut-down does not show.
    /// Always inlined, because a poll needs one or two of them at a time.
    #[inline(always)]
    pub(super) fn last_readings(&self, chip: &Tmc5160<D>) -> Readings {
        let all = self.driver >> drv_status::FLAGS_BIT | (self.driver >> drv_status::S2VSA_BIT & 0b11) << 8;
        let flags = if self.delays.releasing > 0 { all & !SHUT_DOWN } else { all };
        Readings {
            load: (self.driver & drv_status::SG_RESULT) as u16,
            current: (self.driver >> drv_status::CS_ACTUAL_BIT & 0x1F) as u8,
            flags,
            shut_downs: flags & SHUT_DOWN,
            waits: self.stealth_chop.waits && self.rests(),
            switches: self.closed,
            deviates: self.deviates,
            is_lost: chip.is_lost(),
        }
    }
}

/// The flags of the driver as parameter 208 shows them. Bits 0 to 7 are those of DRV_STATUS from StallGuard to stst, as
/// on a TMC262, and bits 8 and 9 the shorts to the supply.
mod flags {
    /// ot: over-temperature.
    pub(super) const OVERTEMPERATURE: u32 = 1 << 1;
    /// s2ga and s2gb: a short to ground.
    pub(super) const SHORTS_TO_GROUND: u32 = 0b11 << 3;
    /// s2vsa and s2vsb: a short to the supply.
    pub(super) const SHORTS_TO_SUPPLY: u32 = 0b11 << 8;
}
