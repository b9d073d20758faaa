//! Reading and writing of axis parameters (manual chapter 4). Some are read from a chip or written to one at once; the
//! others are values with which the next poll works.

use super::Error;
use super::hardware::{Hardware, Mode, RampGenerator, Shape};
use super::joined::Joined;
use super::stall::Measured;
use crate::param::{AxisParameter as P, Parameter};
use crate::units::Micros;

impl<H: Hardware> Joined<'_, H> {
    /// Reads a parameter, in its unit in the product's table. Reading parameter 207 clears it.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not answer.
    pub fn read(&mut self, parameter: P) -> Result<i32, Error> {
        Ok(match parameter {
            P::TargetPosition => self.axis.hardware.known().target,
            P::ActualPosition => self.actual_position()?,
            P::TargetSpeed => self.target_speed()?,
            P::ActualSpeed => self.actual_speed()?,
            P::PositionReached => i32::from(self.actual_position()? == self.axis.hardware.known().target),
            P::HomeSwitch => i32::from(self.axis.sensors.home),
            P::RightSwitch => i32::from(self.switches()?.right),
            P::LeftSwitch => i32::from(self.switches()?.left),
            P::RampMode => self.axis.hardware.known().mode as i32,
            P::SmartEnergyActualCurrent => self.readings().current.into(),
            P::ActualLoad => self.readings().load.into(),
            P::ExtendedErrorFlags => core::mem::take(&mut self.axis.orders.errors),
            // Those read last, and all shut-downs since the last motion command.
            P::DriverErrorFlags => (self.readings().flags | self.axis.orders.alarms) as i32,
            P::EncoderPosition => self.axis.encoders.built_in.position(),
            P::AbsoluteResolverValue => self.axis.sensors.encoder.unwrap_or_default().into(),
            P::ExternalEncoderPosition => self.axis.encoders.external.position(),
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
            | P::ChopperHysteresisDecrement
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
            | P::MaximumExternalEncoderDeviation
            | P::GroupIndex
            | P::EncoderMode
            | P::StepDirectionMode
            | P::SwapSwitches
            | P::FirstAcceleration
            | P::FirstVelocity
            | P::MaximumDeceleration
            | P::LastDeceleration
            | P::StartVelocity
            | P::StopVelocity
            | P::RampWaitTime
            | P::HighSpeedThreshold
            | P::DcStepMinimumSpeed
            | P::RightSwitchPolarity
            | P::LeftSwitchPolarity
            | P::HighSpeedChopperMode
            | P::HighSpeedFullStepMode
            | P::PowerDownRamp
            | P::DcStepTime
            | P::DcStepStallGuard
            | P::RelativePositioning
            | P::ChopperSynchronization
            | P::PwmThresholdSpeed
            | P::PwmGradient
            | P::PwmAmplitude
            | P::PwmFrequency
            | P::PwmAutoscale
            | P::FullStepResolution
            | P::FreewheelingMode
            | P::EncoderResolution
            | P::ChipEncoderDeviation
            | P::ReverseShaft
            | P::UnitMode => self.axis.values.get(parameter),
            P::ActualAcceleration
            | P::MeasuredSpeed
            | P::PwmScale
            | P::PwmMode
            | P::LatchedPosition
            | P::LatchedEncoderPosition
            | P::ChipEncoderPosition => {
                let (mut chips, profile) = self.chips_and_profile();
                chips.reading(profile.values, parameter)?
            }
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

    /// Writes a parameter, whatever the product's table says of it: for a firmware that has ranges of its own, and for a
    /// parameter that the table does not have. The value is one that the hardware can take.
    ///
    /// # Errors
    /// As with [`write`](Self::write).
    pub fn set(&mut self, now: Micros, parameter: P, value: i32) -> Result<(), Error> {
        match parameter {
            P::TargetPosition => self.move_to(now, value),
            P::ActualPosition => self.overwrite_position(now, value),
            P::TargetSpeed if self.axis.takes_speed() => self.rotate(now, value),
            P::TargetSpeed => Ok(()),
            P::RampMode => {
                let mode = match value {
                    0 => Mode::Ramp,
                    1 => Mode::Soft,
                    _ => Mode::Velocity,
                };
                self.change_mode(now, mode)
            }
            P::EncoderPosition => {
                self.axis.encoders.built_in.set(value);
                Ok(())
            }
            P::ExternalEncoderPosition => {
                self.axis.encoders.external.set(value);
                Ok(())
            }
            P::ExternalEncoderPrescaler => {
                self.axis.values.set(parameter, value);
                self.axis.arm_null();
                Ok(())
            }
            P::RampDivisor => self.set_divisors(value, self.axis.values.get(P::PulseDivisor)),
            P::PulseDivisor => self.set_divisors(self.axis.values.get(P::RampDivisor), value),
            P::MaximumSpeed
            | P::MaximumAcceleration
            | P::RightSwitchDisable
            | P::LeftSwitchDisable
            | P::MinimumSpeed
            | P::ReferenceTolerance
            | P::SoftStop
            | P::SwapSwitches
            | P::FirstAcceleration
            | P::FirstVelocity
            | P::MaximumDeceleration
            | P::LastDeceleration
            | P::StartVelocity
            | P::StopVelocity
            | P::RampWaitTime
            | P::RightSwitchPolarity
            | P::LeftSwitchPolarity => self.change(parameter, value, Self::retune),
            // The ramps and the driver's thresholds are in this unit.
            P::UnitMode => self.change(parameter, value, |axis| {
                axis.retune()?;
                axis.write_driver()
            }),
            P::ChipEncoderPosition => self.chips().set_encoder(value),
            P::MicrostepResolution | P::StallGuardFilter | P::StallGuardThreshold => {
                let before = self.axis.values.get(parameter);
                self.change(parameter, value, Self::write_driver)?;
                if value != before {
                    // The load measurement that is under way in the driver was begun with the old setting.
                    self.axis.measured = Measured::default();
                }
                Ok(())
            }
            P::StepInterpolation
            | P::DoubleStep
            | P::ChopperBlankTime
            | P::ConstantToffMode
            | P::DisableFastDecayComparator
            | P::ChopperHysteresisDecrement
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
            | P::RandomToffMode
            | P::ReverseShaft
            | P::HighSpeedThreshold
            | P::DcStepMinimumSpeed
            | P::HighSpeedChopperMode
            | P::HighSpeedFullStepMode
            | P::PowerDownRamp
            | P::DcStepTime
            | P::DcStepStallGuard
            | P::PwmThresholdSpeed
            | P::PwmGradient
            | P::PwmAmplitude
            | P::PwmFrequency
            | P::PwmAutoscale
            | P::EncoderMode
            | P::FullStepResolution
            | P::FreewheelingMode
            | P::EncoderResolution
            | P::ChipEncoderDeviation => self.change(parameter, value, Self::write_driver),
            P::StopOnStall => {
                if value > self.axis.values.get(parameter) {
                    // The motor may have been at or below the new speed a moment ago.
                    self.axis.measured = Measured::default();
                }
                self.keep(parameter, value)
            }
            // The next poll, or the next reference search, works with the new values of these parameters.
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
            | P::MaximumExternalEncoderDeviation
            | P::GroupIndex
            | P::StepDirectionMode
            | P::Vsense
            | P::RelativePositioning
            | P::ChopperSynchronization => self.keep(parameter, value),
            P::ActualSpeed
            | P::PositionReached
            | P::HomeSwitch
            | P::RightSwitch
            | P::LeftSwitch
            | P::ActualAcceleration
            | P::SmartEnergyActualCurrent
            | P::EndSwitchDistance
            | P::LastReferencePosition
            | P::ActualLoad
            | P::ExtendedErrorFlags
            | P::DriverErrorFlags
            | P::AbsoluteResolverValue
            | P::MeasuredSpeed
            | P::PwmScale
            | P::PwmMode
            | P::LatchedPosition
            | P::LatchedEncoderPosition => Err(Error::ReadOnly),
        }
    }

    /// Writes both divisors at once, RAMP_DIV and PULSE_DIV: each of them may go with the other one's new value only. The
    /// motor stands.
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
