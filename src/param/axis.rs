//! The functions of axis parameters (manual chapter 4), and for each of them what reading and writing it takes. What is
//! done *specially* for one parameter stands in `motion/parameters.rs`.

use super::functions;

/// Where the value of an axis parameter comes from when it is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// The value of a setting is kept.
    Kept,
    /// The hardware of the axis has the parameter, and other hardware has not.
    Hardware,
    /// The axis finds the value in a way that only this parameter has.
    Computed(Computed),
}

/// The effect of writing an axis parameter: what happens besides that its value changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Writing {
    /// Nothing happens. The next command, reference search or poll that needs the value works with the new one.
    Plain,
    /// The motor goes on with another profile: the value is one of its ramps or of its stop switches.
    Profile,
    /// The next poll finds another current for the motor. A driver that chooses the current itself is told at once.
    Excitation,
    /// The driver is told at once.
    Driver,
    /// The driver is told at once, and measures the load of the motor anew.
    Load,
    /// Hosts cannot write the parameter: only the axis knows its value.
    ReadOnly,
    /// Something that only this parameter does.
    Special(Special),
}

/// Makes the enum of axis parameters, with a [`Source`] and a [`Writing`] for each. A setting says what writing it
/// does: `plain`, `profile`, `excitation`, `driver` or `load`, `result` where the axis alone sets it, or *written
/// specially*. A computed parameter says how it is read: as a `reading` of the hardware or *specially*; it can be
/// written where it is *written specially* as well.
macro_rules! axis_parameters {
    (
        $(#[$meta:meta])* $name:ident;
        settings { $(
            $(#[$word_meta:meta])* $word:ident $(= $word_kind:ident)? $(, written $word_special:ident)?;
        )* }
        bytes { $(
            $(#[$byte_meta:meta])* $byte:ident $(= $byte_kind:ident)? $(, written $byte_special:ident)?;
        )* }
        computed { $(
            $(#[$found_meta:meta])*
            $found:ident $(= $reading:ident)? $(, read $read:ident)? $(, written $special:ident)?;
        )* }
    ) => {
        functions! {
            $(#[$meta])* $name;
            settings { $($(#[$word_meta])* $word,)* }
            bytes { $($(#[$byte_meta])* $byte,)* }
            computed { $($(#[$found_meta])* $found,)* }
        }

        /// The axis parameters whose values are found in a way of their own.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub(crate) enum Computed {
            $($(#[doc = concat!("Read ", stringify!($read), ".")] $found,)?)*
        }

        /// The axis parameters that do something of their own when they are written.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub(crate) enum Special {
            $($(#[doc = concat!("Written ", stringify!($word_special), ".")] $word,)?)*
            $($(#[doc = concat!("Written ", stringify!($byte_special), ".")] $byte,)?)*
            $($(#[doc = concat!("Written ", stringify!($special), ".")] $found,)?)*
        }

        impl $name {
            /// Where the value comes from when the parameter is read.
            pub(crate) const fn source(self) -> Source {
                match self {
                    $($name::$word)|* | $($name::$byte)|* => Source::Kept,
                    $($name::$found => source!($($reading)? $(read $read $found)?),)*
                }
            }

            /// The effect of writing the parameter.
            pub(crate) const fn writing(self) -> Writing {
                match self {
                    $($name::$word => writing!($($word_kind)? $(written $word_special $word)?),)*
                    $($name::$byte => writing!($($byte_kind)? $(written $byte_special $byte)?),)*
                    $($name::$found => writing!($(written $special $found)? result),)*
                }
            }
        }
    };
}

/// The source of a computed parameter.
macro_rules! source {
    (reading) => {
        Source::Hardware
    };
    (read specially $parameter:ident) => {
        Source::Computed(Computed::$parameter)
    };
}

/// The effect of writing a parameter of a kind, or of one that is written specially in place of that.
macro_rules! writing {
    (plain) => {
        Writing::Plain
    };
    (profile) => {
        Writing::Profile
    };
    (excitation) => {
        Writing::Excitation
    };
    (driver) => {
        Writing::Driver
    };
    (load) => {
        Writing::Load
    };
    (result) => {
        Writing::ReadOnly
    };
    (written specially $parameter:ident $(result)?) => {
        Writing::Special(Special::$parameter)
    };
}

axis_parameters! {
    /// The function of an axis parameter; its number, its range and its unit belong to the product's
    /// [`Row`](super::Row). Speeds and accelerations are in the units that the product has.
    AxisParameter;
    settings {
        /// Top speed of positioning moves, in the product's unit of speed.
        MaximumSpeed = profile;
        /// Acceleration and deceleration of all ramps, in the product's unit of acceleration.
        MaximumAcceleration = profile;
        /// Speed at which a ramp ends (V_MIN of the TMC429), in its internal velocity units.
        MinimumSpeed = profile;
        /// Tolerance in microsteps around the reference switch (DX_REF_TOLERANCE of the TMC429).
        ReferenceTolerance = profile;
        /// stallGuard2 threshold, signed: a higher value makes stall detection less sensitive.
        StallGuardThreshold = load;
        /// Speed, in the product's unit, above which a load value of zero stops the motor; 0: never.
        StopOnStall, written specially;
        /// Speed, in the product's unit, above which coolStep works; 0: always.
        SmartEnergyThresholdSpeed = excitation;
        /// Speed at which a reference search looks for a switch, in the product's unit of speed.
        ReferenceSearchSpeed = plain;
        /// Speed at which a reference search approaches the found switch, in the product's unit of speed.
        ReferenceSwitchSpeed = plain;
        /// Distance in microsteps between the end switches, as the last reference search measured it.
        EndSwitchDistance = result;
        /// Position in microsteps just before a reference search set it to zero.
        LastReferencePosition = result;
        /// Time at standstill after which the driver stage is switched off, in units of 10 ms; 0: never.
        Freewheeling = excitation;
        /// Microsteps per step of the built-in encoder, in 1/512, with a special function in bit 2.
        EncoderPrescaler = plain;
        /// Deviation from the built-in encoder that stops the motor, in encoder steps; 0: none.
        MaximumEncoderDeviation = plain;
        /// Time at standstill after which the standby current applies, in units of 10 ms.
        PowerDownDelay = excitation;
        /// Microsteps per step of the external encoder, in 1/512, with special functions in bits 2..4.
        ExternalEncoderPrescaler, written specially;
        /// Deviation from the external encoder that stops the motor, in encoder steps; 0: none.
        MaximumExternalEncoderDeviation = plain;
        /// Mode of the encoder. It is kept, without effect where the counter is not in the driver.
        EncoderMode = driver;
        /// Acceleration A1 of a ramp in two parts, from its start to its first velocity, in the product's unit of
        /// acceleration.
        FirstAcceleration = profile;
        /// Velocity V1, in the product's unit of speed, at which a ramp goes over from A1 to parameter 5, and from DMAX
        /// to D1; 0: it has one part only.
        FirstVelocity = profile;
        /// Deceleration DMAX from the top speed to the first velocity, in the product's unit of acceleration.
        MaximumDeceleration = profile;
        /// Deceleration D1 from the first velocity to the stop, in the product's unit of acceleration.
        LastDeceleration = profile;
        /// Speed VSTART with which a ramp begins, in the product's unit of speed.
        StartVelocity = profile;
        /// Speed VSTOP with which a positioning ramp ends, in the product's unit of speed.
        StopVelocity = profile;
        /// Time at standstill before the motor may move again, in units of 512 clocks, 32 us.
        RampWaitTime = profile;
        /// Speed, in the product's unit, above which the chopper works as parameters 27 and 28 say; 0: none.
        HighSpeedThreshold = driver;
        /// Speed, in the product's unit, above which dcStep works; 0: never.
        DcStepMinimumSpeed = driver;
        /// Reference pulse width of dcStep, in clocks.
        DcStepTime = driver;
        /// Speed, in the product's unit, below which the driver regulates voltage (stealthChop); 0: never.
        PwmThresholdSpeed = driver;
        /// Full steps of a turn of the motor.
        FullStepResolution = driver;
        /// Counts of a turn of the encoder whose counter is in the driver; 0: there is no encoder.
        EncoderResolution = driver;
        /// Deviation from the encoder whose counter is in the driver that stops the motor, in encoder steps; 0: none.
        ChipEncoderDeviation = driver;
    }
    bytes {
        /// Current of the moving motor, in 1/255 of the module's full current.
        MaximumCurrent = excitation;
        /// Current of the resting motor, in 1/255 of the module's full current.
        StandbyCurrent = excitation;
        /// 1: the right stop switch does not stop the motor.
        RightSwitchDisable = profile;
        /// 1: the left stop switch does not stop the motor.
        LeftSwitchDisable = profile;
        /// Microsteps per full step, as the exponent of a power of two.
        MicrostepResolution = load;
        /// At a stop switch, 0: the motor stops at once; 1: the motor decelerates along the ramp.
        SoftStop = profile;
        /// 1: a motor stopped by an end switch gets the standby current, and may freewheel.
        EndSwitchPowerDown = excitation;
        /// Exponent of the divisor for accelerations (RAMP_DIV of the TMC429).
        RampDivisor, written specially;
        /// Exponent of the divisor for velocities (PULSE_DIV of the TMC429).
        PulseDivisor, written specially;
        /// 1: the driver interpolates 16 microsteps to 256.
        StepInterpolation = driver;
        /// 1: both edges of the step signal make a microstep.
        DoubleStep = driver;
        /// Chopper blank time, as a choice of clock counts.
        ChopperBlankTime = driver;
        /// Chopper mode, 0: spreadCycle; 1: constant off time.
        ConstantToffMode = driver;
        /// 1: in constant off time mode the comparator does not end the fast decay phase.
        DisableFastDecayComparator = driver;
        /// Time between two decrements of the hysteresis in spreadCycle, as a choice of clock counts. In constant
        /// off time mode it has no effect.
        ChopperHysteresisDecrement = driver;
        /// Hysteresis end in spreadCycle, fast decay time in constant off time mode.
        ChopperHysteresisEnd = driver;
        /// Hysteresis start in spreadCycle, sine wave offset in constant off time mode.
        ChopperHysteresisStart = driver;
        /// Chopper off time; 0 switches the driver stage off.
        ChopperOffTime = driver;
        /// Lowest coolStep current, 0: a half, 1: a quarter of the set current.
        SmartEnergyCurrentMinimum = driver;
        /// Load readings per step by which coolStep lowers the current, as a choice.
        SmartEnergyDownStep = driver;
        /// Width of the load range in which coolStep keeps the current.
        SmartEnergyHysteresis = driver;
        /// Steps by which coolStep raises the current at once, as a choice.
        SmartEnergyUpStep = driver;
        /// Load threshold below which coolStep raises the current; 0 switches coolStep off.
        SmartEnergyHysteresisStart = driver;
        /// 1: stallGuard2 takes one load reading per four full steps.
        StallGuardFilter = load;
        /// Slope of the high side gate drivers, 0 (slowest) to 3.
        SlopeHighSide = driver;
        /// Slope of the low side gate drivers, 0 (slowest) to 3.
        SlopeLowSide = driver;
        /// 1: protection against shorts to ground is off.
        ShortProtectionDisable = driver;
        /// Time after which a short to ground is detected, as a choice.
        ShortDetectionTimer = driver;
        /// Full-scale voltage of the sense resistors, 0: high, 1: low. It is kept, without effect where the driver has
        /// no such field.
        Vsense = driver;
        /// Current of a motor below the coolStep threshold speed, in 1/255 of the module's full current.
        SmartEnergySlowRunCurrent = excitation;
        /// 1: the chopper off time varies at random.
        RandomToffMode = driver;
        /// The switches that a reference search goes to, and from which side (manual section 7.1).
        ReferenceSearchMode = plain;
        /// Current while the speed changes, in 1/255 of the module's full current; 0: none of its own.
        BoostCurrent = excitation;
        /// The group of axes that move together, 1..=255; 0: none.
        GroupIndex = plain;
        /// Mode of the step and direction inputs. It is kept, without effect.
        StepDirectionMode = plain;
        /// 1: the inputs of the left and the right stop switch are swapped.
        SwapSwitches = profile;
        /// 1: the right stop switch is closed while its input is low.
        RightSwitchPolarity = profile;
        /// 1: the left stop switch is closed while its input is low.
        LeftSwitchPolarity = profile;
        /// 1: above the speed of parameter 22 the chopper works with constant off time.
        HighSpeedChopperMode = driver;
        /// 1: above the speed of parameter 22 the motor turns in full steps.
        HighSpeedFullStepMode = driver;
        /// Time of each step in which the current of a resting motor falls, as a choice of clock counts.
        PowerDownRamp = driver;
        /// Length of the step at dcStep below which a stall is detected, in 1/16 clocks.
        DcStepStallGuard = driver;
        /// Start of the distance of MVP REL, 0: the target, 1: the actual position, 2: the encoder's position.
        RelativePositioning = plain;
        /// Synchronization of both phases' choppers. It is kept, without effect where the driver has no such field.
        ChopperSynchronization = plain;
        /// Gradient of the voltage over the speed in stealthChop.
        PwmGradient = driver;
        /// Amplitude of the voltage at rest in stealthChop.
        PwmAmplitude = driver;
        /// Frequency of the voltage's pulses in stealthChop, as a choice.
        PwmFrequency = driver;
        /// 1: stealthChop finds the amplitude by itself.
        PwmAutoscale = driver;
        /// Behaviour of a motor without standby current, 0: it is held, 1: it turns freely, 2 and 3: its windings are
        /// shorted.
        FreewheelingMode = driver;
        /// 1: the motor turns the other way round.
        ReverseShaft = driver;
        /// The unit of all speeds and accelerations, 0: that of the ramp generator's registers, 1: pps and pps2.
        UnitMode, written specially;
    }
    computed {
        /// Target position in microsteps; writing it starts a positioning move.
        TargetPosition, read specially, written specially;
        /// Actual position in microsteps.
        ActualPosition, read specially, written specially;
        /// Target speed in the product's unit, signed.
        TargetSpeed, read specially, written specially;
        /// Actual speed of the ramp generator in the product's unit, signed.
        ActualSpeed, read specially;
        /// 1 while the actual position is equal to the target position.
        PositionReached, read specially;
        /// State of the home switch, 1: active.
        HomeSwitch, read specially;
        /// State of the right stop switch, 1: active.
        RightSwitch, read specially;
        /// State of the left stop switch, 1: active.
        LeftSwitch, read specially;
        /// Actual acceleration of the ramp generator, in the product's unit.
        ActualAcceleration = reading;
        /// Mode of the ramp generator, 0: position, 1: soft, 2: velocity.
        RampMode, read specially, written specially;
        /// Motor current as coolStep has set it, in 1/32 of the full current.
        SmartEnergyActualCurrent, read specially;
        /// stallGuard2 load value; 0 is the highest load.
        ActualLoad, read specially;
        /// Causes for which the motor was stopped: bit 0 a stall, bit 1 an encoder deviation.
        ExtendedErrorFlags, read specially;
        /// Status bits of the driver.
        DriverErrorFlags, read specially;
        /// Position of the built-in encoder, in microsteps.
        EncoderPosition, read specially, written specially;
        /// Angle of the built-in encoder, in 1/1024 turn.
        AbsoluteResolverValue, read specially;
        /// Position of the external encoder, in microsteps.
        ExternalEncoderPosition, read specially, written specially;
        /// Speed of the motor as the driver has measured it between two steps, in the product's unit, signed.
        MeasuredSpeed = reading;
        /// Amplitude that stealthChop uses now.
        PwmScale = reading;
        /// 1 while the driver works with stealthChop.
        PwmMode = reading;
        /// Actual position in microsteps that the ramp generator has latched last at a stop switch.
        LatchedPosition = reading;
        /// Position of the encoder whose counter is in the driver, as it was latched last.
        LatchedEncoderPosition = reading;
        /// Position of the encoder whose counter is in the driver, in encoder steps.
        ChipEncoderPosition = reading, written specially;
    }
}
