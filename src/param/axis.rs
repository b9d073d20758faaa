//! What axis parameters do (manual chapter 4).

use super::functions;

functions! {
    /// What an axis parameter does, whatever number it has.
    AxisParameter;
    settings {
        /// Maximum positioning speed.
        MaximumSpeed,
        /// Maximum acceleration.
        MaximumAcceleration,
        /// Maximum current.
        MaximumCurrent,
        /// Standby current.
        StandbyCurrent,
        /// Right limit switch disable.
        RightSwitchDisable,
        /// Left limit switch disable.
        LeftSwitchDisable,
        /// Minimum speed.
        MinimumSpeed,
        /// Microstep resolution.
        MicrostepResolution,
        /// Reference switch tolerance.
        ReferenceTolerance,
        /// Soft stop flag.
        SoftStop,
        /// End switch power down mode.
        EndSwitchPowerDown,
        /// Ramp divisor.
        RampDivisor,
        /// Pulse divisor.
        PulseDivisor,
        /// Step interpolation enable.
        StepInterpolation,
        /// Double step enable.
        DoubleStep,
        /// Chopper blank time.
        ChopperBlankTime,
        /// Constant TOff mode.
        ConstantToffMode,
        /// Disable fast decay comparator.
        DisableFastDecayComparator,
        /// Chopper hysteresis end / fast decay time.
        ChopperHysteresisEnd,
        /// Chopper hysteresis start / sine wave offset.
        ChopperHysteresisStart,
        /// Chopper off time.
        ChopperOffTime,
        /// SmartEnergy current minimum.
        SmartEnergyCurrentMinimum,
        /// SmartEnergy current down step.
        SmartEnergyDownStep,
        /// SmartEnergy hysteresis.
        SmartEnergyHysteresis,
        /// SmartEnergy current up step.
        SmartEnergyUpStep,
        /// SmartEnergy hysteresis start.
        SmartEnergyHysteresisStart,
        /// StallGuard2 filter enable.
        StallGuardFilter,
        /// StallGuard2 threshold.
        StallGuardThreshold,
        /// Slope control high side.
        SlopeHighSide,
        /// Slope control low side.
        SlopeLowSide,
        /// Short protection disable.
        ShortProtectionDisable,
        /// Short detection timer.
        ShortDetectionTimer,
        /// Vsense.
        Vsense,
        /// Stop on stall.
        StopOnStall,
        /// SmartEnergy threshold speed.
        SmartEnergyThresholdSpeed,
        /// SmartEnergy slow run current.
        SmartEnergySlowRunCurrent,
        /// Random TOFF mode.
        RandomToffMode,
        /// Reference search mode.
        ReferenceSearchMode,
        /// Reference search speed.
        ReferenceSearchSpeed,
        /// Reference switch speed.
        ReferenceSwitchSpeed,
        /// End switch distance.
        EndSwitchDistance,
        /// Last reference position.
        LastReferencePosition,
        /// Boost current.
        BoostCurrent,
        /// Freewheeling.
        Freewheeling,
        /// Encoder prescaler.
        EncoderPrescaler,
        /// Maximum encoder deviation.
        MaximumEncoderDeviation,
        /// Power down delay.
        PowerDownDelay,
        /// External encoder prescaler.
        ExternalEncoderPrescaler,
        /// Maximum external encoder deviation.
        MaximumExternalEncoderDeviation,
    }
    computed {
        /// Target position.
        TargetPosition,
        /// Actual position.
        ActualPosition,
        /// Target speed.
        TargetSpeed,
        /// Actual speed.
        ActualSpeed,
        /// Position reached flag.
        PositionReached,
        /// Home switch state.
        HomeSwitch,
        /// Right limit switch state.
        RightSwitch,
        /// Left limit switch state.
        LeftSwitch,
        /// Actual acceleration.
        ActualAcceleration,
        /// Ramp mode.
        RampMode,
        /// SmartEnergy actual current.
        SmartEnergyActualCurrent,
        /// Actual load value.
        ActualLoad,
        /// Extended error flags.
        ExtendedErrorFlags,
        /// TMC262 error flags.
        DriverErrorFlags,
        /// Encoder position.
        EncoderPosition,
        /// Absolute resolver value.
        AbsoluteResolverValue,
        /// External encoder position.
        ExternalEncoderPosition,
    }
}
