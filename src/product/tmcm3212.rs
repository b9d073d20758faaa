//! The TMCM-3212 with its TMCL firmware: three axes, each with a motion controller of its own. The ramp generator is in
//! the driver chip: speeds are in pps, accelerations in pps2. The module has a counter for an encoder of each axis,
//! which is in the chip as well. No axis parameter is stored.

use super::{tmcm1140, tmcm6110};
use crate::executor::ports::Signal;
use crate::executor::{Product, Slots, Spec};
use crate::param::{ANY, AxisParameter, FLAG, GlobalParameter, Parameter, Table, derived, unstored};
use crate::store::{Layout, Memory, Pair, Storing};
use crate::tmcl::{Command, Opcode};

/// Numbers of parameters of other ramp generators and drivers.
const OTHERS: &[u8] = &[130, 135, 138, 141, 149, 150, 153, 154, 160, 161, 175, 176, 178, 183, 200];

/// The axis parameters of the TMCM-6110, none of which is stored here.
const SISTERS: [Parameter<AxisParameter>; tmcm6110::AXIS.rows.len()] = unstored(tmcm6110::AXIS.rows);

/// Axis parameters (manual chapter 3.6.4, table 1).
pub static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(derived! { AxisParameter;
    of &SISTERS, without OTHERS;
    2 TargetSpeed "target speed" Pps &[(-7_999_774, 7_999_774)], ReadWrite Volatile 0 "in velocity mode as ROR; in a positioning move writing it does nothing, and it reads the speed of the ramp",
    3 ActualSpeed "actual speed" Pps &[(-7_999_774, 7_999_774)], Read Volatile 0 "speed of the ramp generator",
    4 MaximumSpeed "maximum positioning speed" Pps &[(0, 7_999_774)], ReadWrite Volatile 51200 "the chip ends at 7 999 512 pps, and gets no more",
    5 MaximumAcceleration "maximum acceleration" Pps2 &[(0, 7_629_278)], ReadWrite Volatile 51200 "AMAX: above the speed of parameter 16, and in velocity mode; in steps of 116.4 pps2, of which the chip gets at least one, also of 15, 17 and 18",
    9 HomeSwitch "home switch state" Flag FLAG, Read Volatile 0 "each motor has an input of its own",
    12 RightSwitchDisable "right limit switch disable" Flag FLAG, ReadWrite Volatile 0 "1 = switch does not stop the motor",
    13 LeftSwitchDisable "left limit switch disable" Flag FLAG, ReadWrite Volatile 0 "1 = switch does not stop the motor",
    14 SwapSwitches "swap limit switches" Flag FLAG, ReadWrite Volatile 0 "1 = the left input is the right switch, and the other way round",
    15 FirstAcceleration "acceleration A1" Pps2 &[(0, 7_629_278)], ReadWrite Volatile 51200 "from the speed of parameter 19 to that of 16; unused while 16 is 0",
    16 FirstVelocity "velocity V1" Pps &[(0, 1_000_000)], ReadWrite Volatile 0 "speed at which A1 (15) gives way to AMAX (5), and DMAX (17) to D1 (18); 0 = AMAX and DMAX alone",
    17 MaximumDeceleration "maximum deceleration" Pps2 &[(0, 7_629_278)], ReadWrite Volatile 51200 "DMAX: above the speed of parameter 16",
    18 LastDeceleration "deceleration D1" Pps2 &[(0, 7_629_278)], ReadWrite Volatile 51200 "from the speed of parameter 16 to that of 20; the chip never gets 0",
    19 StartVelocity "velocity VSTART" Pps &[(0, 249_999)], ReadWrite Volatile 0 "the speed with which a ramp begins",
    20 StopVelocity "velocity VSTOP" Pps &[(0, 249_999)], ReadWrite Volatile 5 "the speed with which a positioning ramp ends; the chip gets at least 1, and no less than VSTART",
    21 RampWaitTime "ramp wait time" Clocks512 &[(0, 65_535)], ReadWrite Volatile 0 "time at standstill before the motor moves again; 31250 = 1 s",
    22 HighSpeedThreshold "speed threshold for high speed mode" Pps &[(0, 7_999_774)], ReadWrite Volatile 0 "THIGH: above this speed 27 and 28 act, and coolStep and stealthChop do not; 0 = off",
    23 DcStepMinimumSpeed "minimum speed for dcStep" Pps &[(0, 7_999_774)], ReadWrite Volatile 0 "VDCMIN: dcStep above this speed; 0 = off; virtual motors are not slowed down by it",
    24 RightSwitchPolarity "right limit switch polarity" Flag FLAG, ReadWrite Volatile 0 "1 = reverse polarity",
    25 LeftSwitchPolarity "left limit switch polarity" Flag FLAG, ReadWrite Volatile 0 "1 = reverse polarity",
    26 SoftStop "soft stop enable" Flag FLAG, ReadWrite Volatile 0 "0 hard stop at a stop switch; 1 decelerate along the ramp",
    27 HighSpeedChopperMode "high speed chopper mode" Flag FLAG, ReadWrite Volatile 0 "1 = constant off time above the speed of parameter 22",
    28 HighSpeedFullStepMode "high speed full step mode" Flag FLAG, ReadWrite Volatile 0 "1 = full steps above the speed of parameter 22",
    29 MeasuredSpeed "measured speed" Pps &[(-7_999_774, 7_999_774)], Read Volatile 0 "from the time between two microsteps, as the driver has measured it; the meaning is a guess",
    31 PowerDownRamp "power down ramp" Clocks2To18 &[(0, 15)], ReadWrite Volatile 7 "time of each step from the run current down to the standby current; 0 = at once",
    32 DcStepTime "dcStep time" Chip &[(0, 1023)], ReadWrite Volatile 0 "DC_TIME, in clocks",
    33 DcStepStallGuard "dcStep stallGuard" Chip &[(0, 255)], ReadWrite Volatile 0 "DC_SG, in 16 clocks; 0 = off",
    127 RelativePositioning "relative positioning option" Choice &[(0, 2)], ReadWrite Volatile 1 "where MVP REL counts from: 0 target, 1 actual position, 2 encoder position",
    179 Vsense "Vsense" Flag FLAG, ReadWrite Volatile 0 "reads back what was written: the driver has no such field",
    181 StopOnStall "stop on stall" Pps &[(0, 7_999_774)], ReadWrite Volatile 0 "a stall above this speed stops the motor; 0 = off",
    182 SmartEnergyThresholdSpeed "smartEnergy threshold speed" Pps &[(0, 7_999_774)], ReadWrite Volatile 0 "speed above which coolStep is active; 0 = always",
    185 ChopperSynchronization "chopper synchronization" Chip &[(0, 15)], ReadWrite Volatile 0 "reads back what was written: the driver has no such field",
    186 PwmThresholdSpeed "PWM threshold speed" Pps &[(0, 7_999_774)], ReadWrite Volatile 0 "TPWMTHRS: stealthChop below this speed; 0 = off",
    187 PwmGradient "PWM gradient" Chip &[(0, 15)], ReadWrite Volatile 0 "0 = stealthChop off; range and meaning are a guess",
    188 PwmAmplitude "PWM amplitude" Chip &[(0, 255)], ReadWrite Volatile 200 "amplitude at standstill",
    189 PwmScale "PWM scale" Chip &[(0, 255)], Read Volatile 0 "PWM_SCALE_SUM: the amplitude that stealthChop uses now",
    190 PwmMode "PWM mode" Flag FLAG, Read Volatile 0 "1 = stealthChop is active now; the meaning is a guess",
    191 PwmFrequency "PWM frequency" Choice &[(0, 3)], ReadWrite Volatile 1 "2/1024, 2/683, 2/512, 2/410 of the clock",
    192 PwmAutoscale "PWM autoscale" Flag FLAG, ReadWrite Volatile 1 "1 = stealthChop finds the amplitude itself",
    194 ReferenceSearchSpeed "reference search speed" Pps &[(0, 7_999_774)], ReadWrite Volatile 51200 "coarse search; taken at RFS START, which refuses 0",
    195 ReferenceSwitchSpeed "reference switch speed" Pps &[(0, 7_999_774)], ReadWrite Volatile 25600 "fine search; taken at RFS START, which refuses 0",
    196 EndSwitchDistance "reference switch distance" Microsteps ANY, Read Volatile 0 "after modes 2 and 3",
    198 LatchedPosition "latched actual position" Microsteps ANY, Read Volatile 0 "XLATCH: where a stop switch has closed or opened, as a reference search has armed it",
    199 LatchedEncoderPosition "latched encoder position" EncoderSteps ANY, Read Volatile 0 "ENC_LATCH: where the last N event was, if 201 has it latched",
    201 EncoderMode "encoder mode" Bits &[(0, 65_535)], ReadWrite Volatile 0 "ENCMODE of the chip, bits 0..9; the kind of fraction, bit 10, is chosen here",
    202 FullStepResolution "motor full step resolution" FullStepsPerTurn &[(0, 65_535)], ReadWrite Volatile 200 "with 140 and 210 it makes the encoder's counts microsteps",
    204 FreewheelingMode "freewheeling mode" Choice &[(0, 3)], ReadWrite Volatile 0 "a standby current (7) of less than 8, with stealthChop: 0 hold, 1 free, 2 low sides shorted, 3 high sides shorted",
    208 DriverErrorFlags "driver error flags" Bits ANY, Read Volatile 0 "DRV_STATUS of the chip; which bits the original has is not published",
    209 ChipEncoderPosition "encoder position" EncoderSteps ANY, ReadWrite Volatile 0 "X_ENC: the counter in the chip",
    210 EncoderResolution "encoder resolution" CountsPerTurn &[(0, 65_535)], ReadWrite Volatile 0 "four counts for each line; with 202 and 140 it gives ENC_CONST; 0 = no encoder",
    212 ChipEncoderDeviation "maximum encoder deviation" EncoderSteps &[(0, 65_535)], ReadWrite Volatile 0 "0 = off",
    214 PowerDownDelay "power down delay" TenMilliseconds &[(0, 417)], ReadWrite Volatile 200 "standstill before the standby current: TPOWERDOWN, in steps of 16.384 ms",
    251 ReverseShaft "reverse shaft" Flag FLAG, ReadWrite Volatile 0 "motor direction",
    255 UnitMode "unit mode" Choice FLAG, ReadWrite Volatile 1 "1: pps and pps2; 0: units of the chip, for all speeds and accelerations of this table, whose ranges stay. Writing it keeps all numbers",
});

/// Global parameters of bank 0: those of the TMCM-1140 but for ASCII mode, and for polarity and direction, which are
/// axis parameters here (24, 25, 251).
pub static GLOBAL: Table<GlobalParameter> = Table::<GlobalParameter>::new(derived! { GlobalParameter;
    of tmcm1140::GLOBAL.rows, without &[67, 79, 90];
});

/// The TMCM-3212. Version 1.05 is that of the manual.
pub static TMCM_3212: Spec = Spec {
    name: *b"3212",
    number: 3212,
    major: 1,
    minor: 5,
    usb: "TMCM-3212",
    axes: 3,
    inputs: 4,
    outputs: 4,
    analog: 0b1111,
    analog_bits: 16,
    signals: &[Signal::Supply, Signal::Temperature, Signal::Enable],
    pull_ups: 0,
    lacks: &[Opcode::Stap, Opcode::Rsap, Opcode::EnterAscii],
    limits_speed: true,
    axis: &AXIS,
    global: &GLOBAL,
    commands: 6144,
    slots: Some(SLOTS),
};

/// The slots: no axis parameters, only coordinates.
const SLOTS: Slots = Slots { variables: 20, axes: 76, each: 20, coordinates: 0 };

/// The TMCM-3212 as a type. Which EEPROM it has is not published: an AT25512 has room for its programs.
#[derive(Clone, Copy, Debug)]
pub struct Tmcm3212;

impl Product for Tmcm3212 {
    const SPEC: &'static Spec = &TMCM_3212;
}

impl Memory for Tmcm3212 {
    const SIZE: usize = 65_536;
    const PAGE: usize = 128;
    const LAYOUT: Layout = Layout {
        tag: b"tmcm 3212 settings 1",
        defaults: const { &SLOTS.defaults::<136>(&AXIS, &GLOBAL) },
        after_erasing: 13,
        other: 5,
        storing: Storing::Pages,
    };
    type Program = [u8; TMCM_3212.commands as usize * Command::SIZE];
    type Values = [i32; 150];
    type Pairs = [Pair; 5];
}
