//! Reading and writing of axis parameters (manual chapter 4). Some are read from a chip or written to one at once; the
//! others are values with which the next poll works. `param/axis.rs` says of which kind each of them is; here stands
//! how the kinds are read and written, and what the parameters take that are read or written specially.

use super::Error;
use super::hardware::{Hardware, RampGenerator, RampMode, Shape};
use super::joined::Joined;
use super::stall::Measured;
use crate::param::{AxisParameter as P, Computed, Parameter, Source, Special, Writing};
use crate::units::Micros;

impl<H: Hardware> Joined<'_, H> {
    /// Reads a parameter, in its unit in the product's table. Reading parameter 207 clears it.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not answer.
    pub fn read(&mut self, parameter: P) -> Result<i32, Error> {
        match parameter.source() {
            Source::Kept => Ok(self.axis.values.get(parameter)),
            Source::Hardware => {
                let (mut chips, profile) = self.chips_and_profile();
                chips.reading(profile.values, parameter)
            }
            Source::Computed(computed) => self.compute(computed),
        }
    }

    /// Finds the value of a parameter that is read specially.
    fn compute(&mut self, parameter: Computed) -> Result<i32, Error> {
        Ok(match parameter {
            Computed::TargetPosition => self.axis.hardware.known().target,
            Computed::ActualPosition => self.chips().position()?,
            Computed::TargetSpeed => self.target_speed()?,
            Computed::ActualSpeed => self.actual_speed()?,
            Computed::PositionReached => i32::from(self.actual_position()? == self.axis.hardware.known().target),
            Computed::HomeSwitch => i32::from(self.axis.sensors.home),
            Computed::RightSwitch => i32::from(self.switches()?.right),
            Computed::LeftSwitch => i32::from(self.switches()?.left),
            Computed::RampMode => self.axis.hardware.known().mode as i32,
            Computed::SmartEnergyActualCurrent => self.readings().current.into(),
            Computed::ActualLoad => self.readings().load.into(),
            Computed::ExtendedErrorFlags => core::mem::take(&mut self.axis.orders.errors),
            // Those read last, and all shut-downs since the last motion command.
            Computed::DriverErrorFlags => (self.readings().flags | self.axis.orders.alarms) as i32,
            Computed::EncoderPosition => self.axis.encoders.built_in.position(),
            Computed::AbsoluteResolverValue => self.axis.sensors.encoder.unwrap_or_default().into(),
            Computed::ExternalEncoderPosition => self.axis.encoders.external.position(),
        })
    }

    /// Writes a parameter, in its unit in the product's table.
    ///
    /// # Errors
    /// The value stays as it was, and the error is [`Error::ReadOnly`], [`Error::OutOfRange`] - also for divisors with
    /// which the ramp generator cannot go to a position - or [`Error::Chip`].
    pub fn write(&mut self, now: Micros, parameter: &Parameter<P>, value: i32) -> Result<(), Error> {
        let Parameter { function, row } = parameter;
        if !row.writable() {
            return Err(Error::ReadOnly);
        }
        if !row.accepts(value) {
            return Err(Error::OutOfRange);
        }
        self.set(now, *function, value)
    }

    /// Writes a parameter, whatever the product's table says of it: for a firmware that has ranges of its own, and for
    /// a parameter that the table does not have. The value is one that the hardware can take.
    ///
    /// # Errors
    /// As with [`write`](Self::write).
    pub fn set(&mut self, now: Micros, parameter: P, value: i32) -> Result<(), Error> {
        match parameter.writing() {
            Writing::Plain => {
                self.axis.values.set(parameter, value);
                Ok(())
            }
            Writing::Profile => self.change(parameter, value, Self::retune),
            Writing::Excitation => self.keep(parameter, value),
            Writing::Driver => self.change(parameter, value, Self::write_driver),
            Writing::Load => {
                let before = self.axis.values.get(parameter);
                self.change(parameter, value, Self::write_driver)?;
                if value != before {
                    // The load measurement that is under way in the driver was begun with the old setting.
                    self.axis.measured = Measured::default();
                }
                Ok(())
            }
            Writing::ReadOnly => Err(Error::ReadOnly),
            Writing::Special(special) => self.set_specially(now, special, value),
        }
    }

    /// Writes a parameter that is written specially.
    fn set_specially(&mut self, now: Micros, parameter: Special, value: i32) -> Result<(), Error> {
        match parameter {
            Special::TargetPosition => self.move_to(now, value),
            Special::ActualPosition => self.overwrite_position(now, value),
            Special::TargetSpeed if self.axis.takes_speed() => self.rotate(now, value),
            Special::TargetSpeed => Ok(()),
            Special::RampMode => {
                let mode = match value {
                    0 => RampMode::Ramp,
                    1 => RampMode::Soft,
                    _ => RampMode::Velocity,
                };
                self.change_mode(now, mode)
            }
            Special::EncoderPosition => {
                self.axis.encoders.built_in.set(value);
                Ok(())
            }
            Special::ExternalEncoderPosition => {
                self.axis.encoders.external.set(value);
                Ok(())
            }
            Special::ExternalEncoderPrescaler => {
                self.axis.values.set(P::ExternalEncoderPrescaler, value);
                self.axis.arm_null();
                Ok(())
            }
            Special::ChipEncoderPosition => self.chips().set_encoder(value),
            Special::RampDivisor => self.set_divisors(value, self.axis.values.get(P::PulseDivisor)),
            Special::PulseDivisor => self.set_divisors(self.axis.values.get(P::RampDivisor), value),
            // The ramps and the driver's thresholds are in this unit.
            Special::UnitMode => self.change(P::UnitMode, value, |axis| {
                axis.retune()?;
                axis.write_driver()
            }),
            Special::StopOnStall => {
                if value > self.axis.values.get(P::StopOnStall) {
                    // The motor may have been at or below the new speed a moment ago.
                    self.axis.measured = Measured::default();
                }
                self.keep(P::StopOnStall, value)
            }
        }
    }

    /// Writes both divisors at once, RAMP_DIV and PULSE_DIV: each of them may go with the other one's new value only.
    /// The motor stands.
    ///
    /// # Errors
    /// The divisors stay as they were, and the error is [`Error::OutOfRange`] where the ramp generator cannot go to a
    /// position with them, or [`Error::Chip`].
    pub fn set_divisors(&mut self, ramp: i32, pulse: i32) -> Result<(), Error> {
        self.change(P::PulseDivisor, pulse, |axis| {
            axis.change(P::RampDivisor, ramp, |axis| {
                if H::Shape::accepts(&axis.axis.values) { axis.retune() } else { Err(Error::OutOfRange) }
            })
        })
    }

    /// Sets a value with which the next poll works, and of which the driver is told at once where it has to know.
    fn keep(&mut self, parameter: P, value: i32) -> Result<(), Error> {
        const { check_driven(H::DRIVEN) };
        if H::DRIVEN.contains(&parameter) {
            return self.change(parameter, value, Self::write_driver);
        }
        self.axis.values.set(parameter, value);
        Ok(())
    }

    /// Sets a value and calls `tell`, which writes it to a chip; takes the value back if that fails.
    fn change(
        &mut self,
        parameter: P,
        value: i32,
        tell: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let old = self.axis.values.get(parameter);
        self.axis.values.set(parameter, value);
        tell(self).inspect_err(|_| self.axis.values.set(parameter, old))
    }
}

/// Panics, which stops the compiler, where one of the parameters of [`Hardware::DRIVEN`] is of a kind whose writing
/// does not ask whether it is among them.
const fn check_driven(parameters: &[P]) {
    let mut i = 0;
    while i < parameters.len() {
        let asked = matches!(parameters[i].writing(), Writing::Excitation | Writing::Special(Special::StopOnStall));
        assert!(asked, "the driver would not be told at once: this parameter has to be one of the excitation");
        i += 1;
    }
}
