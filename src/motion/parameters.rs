//! Reading and writing of axis parameters (manual chapter 4): which of them ask a chip, which tell it something, and
//! which only are values for the next poll.

use embedded_hal::spi::SpiDevice;

use super::ramp::braking;
use super::stall::Measured;
use super::{Axis, Error};
use crate::chip::tmc429::{RampMode, Tmc429};
use crate::param::{AxisParameter as P, Parameter};
use crate::units::Micros;

impl<D: SpiDevice> Axis<D> {
    /// Reads a parameter. Reading 207 clears it.
    pub fn read<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>, parameter: P) -> Result<i32, Error> {
        Ok(match parameter {
            P::TargetPosition => self.position.target,
            P::ActualPosition => self.actual_position(chip)?,
            P::TargetSpeed => self.target_speed(chip)?,
            P::ActualSpeed => self.actual_speed(chip)?,
            P::PositionReached => i32::from(self.actual_position(chip)? == self.position.target),
            P::HomeSwitch => i32::from(self.sensors.home),
            P::RightSwitch => i32::from(self.switches(chip)?.1),
            P::LeftSwitch => i32::from(self.switches(chip)?.0),
            P::ActualAcceleration => self.actual_acceleration(chip)?,
            P::RampMode => self.mode as i32,
            P::SmartEnergyActualCurrent => self.driver.current().into(),
            P::ActualLoad => self.driver.load().into(),
            P::ExtendedErrorFlags => core::mem::take(&mut self.errors),
            P::DriverErrorFlags => self.driver_flags().into(),
            P::EncoderPosition => self.encoder.position(),
            P::AbsoluteResolverValue => self.sensors.encoder.into(),
            P::ExternalEncoderPosition => self.external.position(),
            P::MaximumSpeed
            | P::MaximumAcceleration
            | P::MaximumCurrent
            | P::StandbyCurrent
            | P::RightSwitchDisable
            | P::LeftSwitchDisable
            | P::MinimumSpeed
            | P::MicrostepResolution
            | P::ReferenceTolerance
            | P::SoftStop
            | P::EndSwitchPowerDown
            | P::RampDivisor
            | P::PulseDivisor
            | P::StepInterpolation
            | P::DoubleStep
            | P::ChopperBlankTime
            | P::ConstantToffMode
            | P::DisableFastDecayComparator
            | P::ChopperHysteresisEnd
            | P::ChopperHysteresisStart
            | P::ChopperOffTime
            | P::SmartEnergyCurrentMinimum
            | P::SmartEnergyDownStep
            | P::SmartEnergyHysteresis
            | P::SmartEnergyUpStep
            | P::SmartEnergyHysteresisStart
            | P::StallGuardFilter
            | P::StallGuardThreshold
            | P::SlopeHighSide
            | P::SlopeLowSide
            | P::ShortProtectionDisable
            | P::ShortDetectionTimer
            | P::Vsense
            | P::StopOnStall
            | P::SmartEnergyThresholdSpeed
            | P::SmartEnergySlowRunCurrent
            | P::RandomToffMode
            | P::ReferenceSearchMode
            | P::ReferenceSearchSpeed
            | P::ReferenceSwitchSpeed
            | P::EndSwitchDistance
            | P::LastReferencePosition
            | P::BoostCurrent
            | P::Freewheeling
            | P::EncoderPrescaler
            | P::MaximumEncoderDeviation
            | P::PowerDownDelay
            | P::ExternalEncoderPrescaler
            | P::MaximumExternalEncoderDeviation => self.value(parameter),
        })
    }

    /// Takes a stored value without telling the chips, before [`Axis::start`] does.
    pub fn preset(&mut self, parameter: &Parameter<P>, value: i32) {
        if parameter.row.stored() && parameter.row.accepts(value) {
            self.set_value(parameter.function, value);
        }
    }

    /// Writes a parameter. Where that fails nothing has changed.
    pub fn write<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        parameter: &Parameter<P>,
        value: i32,
    ) -> Result<(), Error> {
        let Parameter { function: parameter, row } = parameter;
        let parameter = *parameter;
        if !row.writable() {
            return Err(Error::ReadOnly);
        }
        if !row.accepts(value) {
            return Err(Error::OutOfRange);
        }
        match parameter {
            P::TargetPosition => self.move_to(now, chip, value),
            P::ActualPosition => self.set_position(now, chip, value),
            P::TargetSpeed if self.takes_speed() => self.rotate(now, chip, value),
            P::TargetSpeed => Ok(()),
            P::RampMode => {
                let mode = match value {
                    0 => RampMode::Ramp,
                    1 => RampMode::Soft,
                    _ => RampMode::Velocity,
                };
                self.change_mode(now, chip, mode)
            }
            P::EncoderPosition => {
                self.encoder.set(value);
                Ok(())
            }
            P::ExternalEncoderPosition => {
                self.external.set(value);
                Ok(())
            }
            P::ExternalEncoderPrescaler => {
                self.set_value(parameter, value);
                self.arm_null(true);
                Ok(())
            }
            P::RampDivisor | P::PulseDivisor => {
                let (ramp_div, pulse_div) = self.divisors();
                let (ramp_div, pulse_div) = match parameter {
                    P::RampDivisor => (value as u8, pulse_div),
                    _ => (ramp_div, value as u8),
                };
                let speed = self.value(P::MaximumSpeed);
                braking(self.value(P::MaximumAcceleration), ramp_div, pulse_div, speed).ok_or(Error::OutOfRange)?;
                self.change(parameter, value, |axis| axis.configure(chip))
            }
            P::MaximumSpeed
            | P::MaximumAcceleration
            | P::RightSwitchDisable
            | P::LeftSwitchDisable
            | P::MinimumSpeed
            | P::ReferenceTolerance
            | P::SoftStop => self.change(parameter, value, |axis| axis.configure(chip)),
            P::MicrostepResolution | P::StallGuardFilter | P::StallGuardThreshold => {
                let before = self.value(parameter);
                self.change(parameter, value, Self::write_driver)?;
                if value != before {
                    // The driver's measurement under way is not one with the new setting.
                    self.measured = Measured::default();
                }
                Ok(())
            }
            P::StepInterpolation
            | P::DoubleStep
            | P::ChopperBlankTime
            | P::ConstantToffMode
            | P::DisableFastDecayComparator
            | P::ChopperHysteresisEnd
            | P::ChopperHysteresisStart
            | P::ChopperOffTime
            | P::SmartEnergyCurrentMinimum
            | P::SmartEnergyDownStep
            | P::SmartEnergyHysteresis
            | P::SmartEnergyUpStep
            | P::SmartEnergyHysteresisStart
            | P::SlopeHighSide
            | P::SlopeLowSide
            | P::ShortProtectionDisable
            | P::ShortDetectionTimer
            | P::RandomToffMode => self.change(parameter, value, Self::write_driver),
            P::StopOnStall => {
                if value > self.value(parameter) {
                    // The motor may have been at or below the new speed a moment ago.
                    self.measured = Measured::default();
                }
                self.set_value(parameter, value);
                Ok(())
            }
            // The next poll works with the values of these.
            P::MaximumCurrent
            | P::StandbyCurrent
            | P::EndSwitchPowerDown
            | P::SmartEnergyThresholdSpeed
            | P::SmartEnergySlowRunCurrent
            | P::ReferenceSearchMode
            | P::ReferenceSearchSpeed
            | P::ReferenceSwitchSpeed
            | P::BoostCurrent
            | P::Freewheeling
            | P::EncoderPrescaler
            | P::MaximumEncoderDeviation
            | P::PowerDownDelay
            | P::MaximumExternalEncoderDeviation => {
                self.set_value(parameter, value);
                Ok(())
            }
            P::ActualSpeed
            | P::PositionReached
            | P::HomeSwitch
            | P::RightSwitch
            | P::LeftSwitch
            | P::ActualAcceleration
            | P::Vsense
            | P::SmartEnergyActualCurrent
            | P::EndSwitchDistance
            | P::LastReferencePosition
            | P::ActualLoad
            | P::ExtendedErrorFlags
            | P::DriverErrorFlags
            | P::AbsoluteResolverValue => Err(Error::ReadOnly),
        }
    }

    /// Sets a value and tells a chip; takes the value back if the chip does not hear it.
    fn change(
        &mut self,
        parameter: P,
        value: i32,
        tell: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let old = self.value(parameter);
        self.set_value(parameter, value);
        tell(self).inspect_err(|_| self.set_value(parameter, old))
    }
}
