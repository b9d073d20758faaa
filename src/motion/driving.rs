//! The current of which the driver of an axis is told. The driver is written when the current changes, and not
//! in each poll.

use super::Error;
use super::current::Excitation;
use super::hardware::Driver;
use super::stall::Measured;
use super::values::Values;

/// The excitation that the driver of an axis was told last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Driving {
    /// The current that the driver was told; `None` if it is to be told anew in any case.
    told: Option<Excitation>,
}

impl Driving {
    /// True if the driver was told this excitation last.
    pub(super) fn is(&self, excitation: Excitation) -> bool {
        self.told == Some(excitation)
    }

    /// Has the driver be told its next excitation in any case.
    pub(super) const fn forget(&mut self) {
        self.told = None;
    }

    /// Gives the motor this current; a driver that has it already is not written to, unless it `waits` for it.
    pub(super) fn refresh(
        &mut self,
        driver: &mut impl Driver,
        values: &Values,
        excitation: Excitation,
        waits: bool,
    ) -> Result<(), Error> {
        if self.told != Some(excitation) || waits {
            self.told = Some(excitation);
            self.write(driver, values).inspect_err(|_| self.told = None)?;
        }
        Ok(())
    }

    /// Writes the driver's parameters and the present excitation to the driver.
    pub(super) fn write(&self, driver: &mut impl Driver, values: &Values) -> Result<(), Error> {
        let Some(excitation) = self.told else { return Ok(()) };
        driver.drive(values, excitation)
    }

    /// Ends a shut-down of the driver, of which `alarms` tells, before a motion: the bridges are switched off here, and
    /// on again with the next excitation. A TMC262 keeps a short to ground latched until its TOFF was zero. What was
    /// `measured` of the load counts no more.
    pub(super) fn release(
        &mut self,
        driver: &mut impl Driver,
        values: &Values,
        alarms: &mut u32,
        measured: &mut Measured,
    ) -> Result<(), Error> {
        let alarm = *alarms != 0;
        let Some(excitation) = self.told.take_if(|_| alarm) else { return Ok(()) };
        *alarms = 0;
        *measured = Measured::default();
        self.told = Some(Excitation { free: true, ..excitation });
        self.write(driver, values)?;
        // Without a remembered excitation the next one is written even if it equals the one before the shut-down.
        self.told = None;
        Ok(())
    }
}
