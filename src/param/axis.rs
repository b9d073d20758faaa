//! The functions of axis parameters (manual chapter 4).

use super::functions;

functions! {
    /// The function of an axis parameter; its number and range belong to the product's [`Row`](super::Row).
    AxisParameter;
    settings {
        /// Top speed of positioning moves, in internal velocity units.
        MaximumSpeed,
        /// Acceleration and deceleration of all ramps, in internal acceleration units.
        MaximumAcceleration,
        /// Speed at which a ramp ends (V_MIN of the TMC429), in internal velocity units.
        MinimumSpeed,
        /// Tolerance in microsteps around the reference switch (DX_REF_TOLERANCE of the TMC429).
        ReferenceTolerance,
        /// stallGuard2 threshold, signed: a higher value makes stall detection less sensitive.
        StallGuardThreshold,
        /// Speed in internal units above which a load value of zero stops the motor; 0: never.
        StopOnStall,
        /// Speed in internal units above which coolStep works; 0: always.
        SmartEnergyThresholdSpeed,
        /// Speed at which a reference search looks for a switch, in internal velocity units.
        ReferenceSearchSpeed,
        /// Speed at which a reference search approaches the found switch, in internal velocity units.
        ReferenceSwitchSpeed,
        /// Distance in microsteps between the end switches, as the last reference search measured it.
        EndSwitchDistance,
        /// Position in microsteps just before a reference search set it to zero.
        LastReferencePosition,
        /// Time at standstill after which the driver stage is switched off, in units of 10 ms; 0: never.
        Freewheeling,
        /// Microsteps per step of the built-in encoder, in 1/512, with a special function in bit 2.
        EncoderPrescaler,
        /// Deviation from the built-in encoder that stops the motor, in encoder steps; 0: none.
        MaximumEncoderDeviation,
        /// Time at standstill after which the standby current applies, in units of 10 ms.
        PowerDownDelay,
        /// Microsteps per step of the external encoder, in 1/512, with special functions in bits 2..4.
        ExternalEncoderPrescaler,
        /// Deviation from the external encoder that stops the motor, in encoder steps; 0: none.
        MaximumExternalEncoderDeviation,
        /// Mode of the encoder. It is kept, without effect where the counter is not in the driver.
        EncoderMode,
        /// Acceleration A1 of a ramp in two parts, from its start to its first velocity.
        FirstAcceleration,
        /// Velocity V1 at which a ramp goes over from A1 to parameter 5, and from DMAX to D1; 0: it has one part only.
        FirstVelocity,
        /// Deceleration DMAX from the top speed to the first velocity.
        MaximumDeceleration,
        /// Deceleration D1 from the first velocity to the stop.
        LastDeceleration,
        /// Speed VSTART with which a ramp begins.
        StartVelocity,
        /// Speed VSTOP with which a positioning ramp ends.
        StopVelocity,
        /// Time at standstill before the motor may move again, in units of 512 clocks, 32 us.
        RampWaitTime,
        /// Speed above which the chopper works as parameters 27 and 28 say; 0: none.
        HighSpeedThreshold,
        /// Speed above which dcStep works; 0: never.
        DcStepMinimumSpeed,
        /// Reference pulse width of dcStep, in clocks.
        DcStepTime,
        /// Speed below which the driver regulates voltage (stealthChop); 0: never.
        PwmThresholdSpeed,
        /// Full steps of a turn of the motor.
        FullStepResolution,
        /// Counts of a turn of the encoder whose counter is in the driver; 0: there is no encoder.
        EncoderResolution,
        /// Deviation from the encoder whose counter is in the driver that stops the motor, in encoder steps; 0: none.
        ChipEncoderDeviation,
    }
    bytes {
        /// Current of the moving motor, in 1/255 of the module's full current.
        MaximumCurrent,
        /// Current of the resting motor, in 1/255 of the module's full current.
        StandbyCurrent,
        /// 1: the right stop switch does not stop the motor.
        RightSwitchDisable,
        /// 1: the left stop switch does not stop the motor.
        LeftSwitchDisable,
        /// Microsteps per full step, as the exponent of a power of two.
        MicrostepResolution,
        /// At a stop switch, 0: the motor stops at once; 1: the motor decelerates along the ramp.
        SoftStop,
        /// 1: a motor stopped by an end switch gets the standby current, and may freewheel.
        EndSwitchPowerDown,
        /// Exponent of the divisor for accelerations (RAMP_DIV of the TMC429).
        RampDivisor,
        /// Exponent of the divisor for velocities (PULSE_DIV of the TMC429).
        PulseDivisor,
        /// 1: the driver interpolates 16 microsteps to 256.
        StepInterpolation,
        /// 1: both edges of the step signal make a microstep.
        DoubleStep,
        /// Chopper blank time, as a choice of clock counts.
        ChopperBlankTime,
        /// Chopper mode, 0: spreadCycle; 1: constant off time.
        ConstantToffMode,
        /// 1: in constant off time mode the comparator does not end the fast decay phase.
        DisableFastDecayComparator,
        /// Time between two decrements of the hysteresis in spreadCycle, as a choice of clock counts. It has no number in
        /// TMCL.
        ChopperHysteresisDecrement,
        /// Hysteresis end in spreadCycle, fast decay time in constant off time mode.
        ChopperHysteresisEnd,
        /// Hysteresis start in spreadCycle, sine wave offset in constant off time mode.
        ChopperHysteresisStart,
        /// Chopper off time; 0 switches the driver stage off.
        ChopperOffTime,
        /// Lowest coolStep current, 0: a half, 1: a quarter of the set current.
        SmartEnergyCurrentMinimum,
        /// Load readings per step by which coolStep lowers the current, as a choice.
        SmartEnergyDownStep,
        /// Width of the load range in which coolStep keeps the current.
        SmartEnergyHysteresis,
        /// Steps by which coolStep raises the current at once, as a choice.
        SmartEnergyUpStep,
        /// Load threshold below which coolStep raises the current; 0 switches coolStep off.
        SmartEnergyHysteresisStart,
        /// 1: stallGuard2 takes one load reading per four full steps.
        StallGuardFilter,
        /// Slope of the high side gate drivers, 0 (slowest) to 3.
        SlopeHighSide,
        /// Slope of the low side gate drivers, 0 (slowest) to 3.
        SlopeLowSide,
        /// 1: protection against shorts to ground is off.
        ShortProtectionDisable,
        /// Time after which a short to ground is detected, as a choice.
        ShortDetectionTimer,
        /// Full-scale voltage of the sense resistors, 0: high, 1: low. It is kept, without effect where the driver has
        /// no such field.
        Vsense,
        /// Current of a motor below the coolStep threshold speed, in 1/255 of the module's full current.
        SmartEnergySlowRunCurrent,
        /// 1: the chopper off time varies at random.
        RandomToffMode,
        /// Which switches a reference search goes to, and from which side (manual section 7.1).
        ReferenceSearchMode,
        /// Current while the speed changes, in 1/255 of the module's full current; 0: none of its own.
        BoostCurrent,
        /// The group of axes that move together, 1..=255; 0: none.
        GroupIndex,
        /// Mode of the step and direction inputs. It is kept, without effect.
        StepDirectionMode,
        /// 1: the inputs of the left and the right stop switch are swapped.
        SwapSwitches,
        /// 1: the right stop switch is closed while its input is low.
        RightSwitchPolarity,
        /// 1: the left stop switch is closed while its input is low.
        LeftSwitchPolarity,
        /// 1: above the speed of parameter 22 the chopper works with constant off time.
        HighSpeedChopperMode,
        /// 1: above the speed of parameter 22 the motor turns in full steps.
        HighSpeedFullStepMode,
        /// Time of each step in which the current of a resting motor falls, as a choice of clock counts.
        PowerDownRamp,
        /// Length of the step at dcStep below which a stall is detected, in 1/16 clocks.
        DcStepStallGuard,
        /// What the distance of MVP REL counts from, 0: the target, 1: the actual position, 2: the encoder's position.
        RelativePositioning,
        /// Synchronization of both phases' choppers. It is kept, without effect where the driver has no such field.
        ChopperSynchronization,
        /// Gradient of the voltage over the speed in stealthChop.
        PwmGradient,
        /// Amplitude of the voltage at rest in stealthChop.
        PwmAmplitude,
        /// Frequency of the voltage's pulses in stealthChop, as a choice.
        PwmFrequency,
        /// 1: stealthChop finds the amplitude by itself.
        PwmAutoscale,
        /// What a motor without standby current does, 0: it is held, 1: it turns freely, 2 and 3: its windings are
        /// shorted.
        FreewheelingMode,
        /// 1: the motor turns the other way round.
        ReverseShaft,
        /// The unit of all speeds and accelerations, 0: that of the ramp generator's registers, 1: pps and pps2.
        UnitMode,
    }
    computed {
        /// Target position in microsteps; writing it starts a positioning move.
        TargetPosition,
        /// Actual position in microsteps.
        ActualPosition,
        /// Target speed in internal velocity units, signed.
        TargetSpeed,
        /// Actual speed of the ramp generator in internal velocity units, signed.
        ActualSpeed,
        /// 1 while the actual position is equal to the target position.
        PositionReached,
        /// State of the home switch, 1: active.
        HomeSwitch,
        /// State of the right stop switch, 1: active.
        RightSwitch,
        /// State of the left stop switch, 1: active.
        LeftSwitch,
        /// Actual acceleration of the ramp generator, in internal acceleration units.
        ActualAcceleration,
        /// Mode of the ramp generator, 0: position, 1: soft, 2: velocity.
        RampMode,
        /// Motor current as coolStep has set it, in 1/32 of the full current.
        SmartEnergyActualCurrent,
        /// stallGuard2 load value; 0 is the highest load.
        ActualLoad,
        /// What has stopped the motor: bit 0 a stall, bit 1 an encoder deviation.
        ExtendedErrorFlags,
        /// Status bits of the driver.
        DriverErrorFlags,
        /// Position of the built-in encoder, in microsteps.
        EncoderPosition,
        /// Angle of the built-in encoder, in 1/1024 turn.
        AbsoluteResolverValue,
        /// Position of the external encoder, in microsteps.
        ExternalEncoderPosition,
        /// Speed of the motor as the driver has measured it between two steps, signed.
        MeasuredSpeed,
        /// Amplitude that stealthChop uses now.
        PwmScale,
        /// 1 while the driver works with stealthChop.
        PwmMode,
        /// Actual position in microsteps that the ramp generator has latched last at a stop switch.
        LatchedPosition,
        /// Position of the encoder whose counter is in the driver, as it was latched last.
        LatchedEncoderPosition,
        /// Position of the encoder whose counter is in the driver, in encoder steps.
        ChipEncoderPosition,
    }
}
