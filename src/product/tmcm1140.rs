//! The TMCM-1140 with its TMCL firmware: one axis on one motion controller. The parameters are in the manual's order.

use crate::executor::ports::Signal;
use crate::executor::{CONVERTER_BITS, Product, Slots, Spec};
use crate::param::{ANY, AxisParameter, FLAG, GlobalParameter, Table, rows};
use crate::store::{Layout, Memory, Pair, Storing};

/// Axis parameters, read by GAP and written by SAP and AAP (manual chapter 4). Parameter 141 is not in the V1.42
/// manual; it is here because existing host software reads this register of the TMC429. Slots count from the first
/// slot of the axis.
pub static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(rows! { AxisParameter;
    0 TargetPosition "target position" Microsteps ANY, ReadWrite Volatile 0 "writing it starts a positioning move (position mode)",
    1 ActualPosition "actual position" Microsteps ANY, ReadWrite Volatile 0 "stop the motor before overwriting; used for referencing",
    2 TargetSpeed "target speed" Internal &[(-2047, 2047)], ReadWrite Volatile 0 "in velocity mode as ROR; in the position modes writing it does nothing, and it reads the ramp generator's own",
    3 ActualSpeed "actual speed" Internal &[(-2047, 2047)], Read Volatile 0 "speed of the ramp generator",
    4 MaximumSpeed "maximum positioning speed" Internal &[(1, 2047)], ReadWrite OnCommand(0) 1000 "top speed of positioning ramps",
    5 MaximumAcceleration "maximum acceleration" Internal &[(1, 2047)], ReadWrite OnCommand(1) 1000 "reads back as written; velocity mode takes it as it is. For positioning the motion controller gets the smallest value from there on that has a PMUL/PDIV pair, at least 2^(153 - 154 - 1) where parameter 4 is above 1448, and at most 2^(153 - 154 + 12) - 1. Manual section 6.1.3 has this lower limit at every speed; but it keeps braking within the 2^19 steps of the motion controller, and from speeds up to 1448 braking takes half of them",
    6 MaximumCurrent "maximum current" Current &[(0, 255)], ReadWrite OnCommand(2) 128 "32 steps of 8; CS = value/8",
    7 StandbyCurrent "standby current" Current &[(0, 255)], ReadWrite OnCommand(3) 8 "used after parameter 214 has elapsed at standstill",
    8 PositionReached "position reached flag" Flag FLAG, Read Volatile 0 "1 while target and actual position are equal",
    9 HomeSwitch "home switch state" Flag FLAG, Read Volatile 0 "logical state",
    10 RightSwitch "right limit switch state" Flag FLAG, Read Volatile 0 "logical state",
    11 LeftSwitch "left limit switch state" Flag FLAG, Read Volatile 0 "logical state",
    12 RightSwitchDisable "right limit switch disable" Flag FLAG, ReadWrite OnCommand(4) 1 "1 = switch does not stop the motor",
    13 LeftSwitchDisable "left limit switch disable" Flag FLAG, ReadWrite OnCommand(5) 1 "1 = switch does not stop the motor",
    130 MinimumSpeed "minimum speed" Internal &[(1, 2047)], ReadWrite OnCommand(6) 1 "stop speed; the start speed is always 1",
    135 ActualAcceleration "actual acceleration" Internal &[(0, 2047)], Read Volatile 0 "acceleration of the ramp generator, smoothed by the chip",
    138 RampMode "ramp mode" Choice &[(0, 2)], ReadWrite Volatile 0 "0 position, 1 soft (exponential approach), 2 velocity; set by ROR, ROL, MST and MVP",
    140 MicrostepResolution "microstep resolution" MicrostepExponent &[(0, 8)], ReadWrite OnCommand(7) 8 "8 = 256 microsteps",
    141 ReferenceTolerance "reference switch tolerance" Microsteps &[(0, 4095)], ReadWrite OnCommand(8) 0 "DX_REF_TOLERANCE of the TMC429; not in the V1.42 manual, but host software reads it",
    149 SoftStop "soft stop flag" Flag FLAG, ReadWrite OnCommand(9) 0 "0 hard stop at a stop switch; 1 decelerate along the ramp",
    150 EndSwitchPowerDown "end switch power down mode" Flag FLAG, ReadWrite OnCommand(10) 0 "stopped by an end switch: 0 = run current, and no freewheeling (204); 1 = standby current",
    153 RampDivisor "ramp divisor" Exponent &[(0, 13)], ReadWrite OnCommand(11) 7 "change only at standstill; PMUL and PDIV are computed anew",
    154 PulseDivisor "pulse divisor" Exponent &[(0, 13)], ReadWrite OnCommand(12) 3 "change only at standstill; PMUL and PDIV are computed anew",
    160 StepInterpolation "step interpolation enable" Flag FLAG, ReadWrite OnCommand(13) 0 "only with 16 microsteps",
    161 DoubleStep "double step enable" Flag FLAG, ReadWrite OnCommand(14) 0 "both edges of the step signal make a microstep",
    162 ChopperBlankTime "chopper blank time" Choice &[(0, 3)], ReadWrite OnCommand(15) 2 "16, 24, 36, 54 clocks",
    163 ConstantToffMode "constant TOff mode" Choice FLAG, ReadWrite OnCommand(16) 0 "0 spreadCycle, 1 constant off time; switches the meaning of 164, 165 and 166",
    164 DisableFastDecayComparator "disable fast decay comparator" Flag FLAG, ReadWrite OnCommand(17) 0 "only in constant off time mode",
    165 ChopperHysteresisEnd "chopper hysteresis end / fast decay time" Chip &[(0, 15)], ReadWrite OnCommand(18) 2 "meaning changes with 163: hysteresis end / fast decay time",
    166 ChopperHysteresisStart "chopper hysteresis start / sine wave offset" Chip &[(0, 8)], ReadWrite OnCommand(19) 3 "8 does not fit the three bits of HSTRT: the chip gets 7; the parameter reads back 8",
    167 ChopperOffTime "chopper off time" Chip &[(0, 15)], ReadWrite OnCommand(20) 5 "0 switches the driver bridges off (motor freewheels)",
    168 SmartEnergyCurrentMinimum "smartEnergy current minimum" Choice FLAG, ReadWrite OnCommand(21) 0 "0 = 1/2 of CS; 1 = 1/4 of CS",
    169 SmartEnergyDownStep "smartEnergy current down step" Choice &[(0, 3)], ReadWrite OnCommand(22) 0 "32, 8, 2, 1 readings per decrement",
    170 SmartEnergyHysteresis "smartEnergy hysteresis" Chip &[(0, 15)], ReadWrite OnCommand(23) 0 "upper threshold = (172 + 170 + 1) * 32",
    171 SmartEnergyUpStep "smartEnergy current up step" Choice &[(0, 3)], ReadWrite OnCommand(24) 0 "1, 2, 4, 8 steps",
    172 SmartEnergyHysteresisStart "smartEnergy hysteresis start" Chip &[(0, 15)], ReadWrite OnCommand(25) 0 "lower coolStep threshold; 0 switches coolStep off",
    173 StallGuardFilter "stallGuard2 filter enable" Flag FLAG, ReadWrite OnCommand(26) 1 "1 = one reading per four full steps",
    174 StallGuardThreshold "stallGuard2 threshold" Chip &[(-64, 63)], ReadWrite OnCommand(27) 5 "higher = less sensitive",
    175 SlopeHighSide "slope control high side" Choice &[(0, 3)], ReadWrite OnCommand(28) 3 "0 slowest, 3 fastest",
    176 SlopeLowSide "slope control low side" Choice &[(0, 3)], ReadWrite OnCommand(29) 3 "0 slowest, 3 fastest",
    177 ShortProtectionDisable "short protection disable" Flag FLAG, ReadWrite OnCommand(30) 0 "1 = short to ground protection off",
    178 ShortDetectionTimer "short detection timer" Choice &[(0, 3)], ReadWrite OnCommand(31) 0 "3.2, 1.6, 1.2, 0.8 microseconds",
    179 Vsense "Vsense" Flag FLAG, Read Volatile 1 "1 = full scale at 1/36 VDD",
    180 SmartEnergyActualCurrent "smartEnergy actual current" CurrentScale &[(0, 31)], Read Volatile 0 "current as scaled by coolStep",
    181 StopOnStall "stop on stall" Internal &[(0, 2047)], ReadWrite OnCommand(32) 0 "a load value of zero, measured wholly above this speed, stops the motor; 0 = off",
    182 SmartEnergyThresholdSpeed "smartEnergy threshold speed" Internal &[(0, 2047)], ReadWrite OnCommand(33) 0 "speed above which coolStep is active; 0 = always",
    183 SmartEnergySlowRunCurrent "smartEnergy slow run current" Current &[(0, 255)], ReadWrite OnCommand(34) 0 "current of a moving motor below the speed of parameter 182, unless 200 applies; 0 = use parameter 6",
    184 RandomToffMode "random TOFF mode" Flag FLAG, ReadWrite OnCommand(35) 0 "1 = random chopper off time",
    193 ReferenceSearchMode "reference search mode" Choice &[(1, 8), (65, 68), (133, 136)], ReadWrite OnCommand(36) 1 "+64: right instead of left (modes 1..4); +128: inverted home switch (modes 5..8, so 133..136: the 129..132 of manual sections 7.1.5 to 7.1.8 do not exist)",
    194 ReferenceSearchSpeed "reference search speed" Internal &[(0, 2047)], ReadWrite OnCommand(37) 500 "coarse search; taken at RFS START, which refuses 0",
    195 ReferenceSwitchSpeed "reference switch speed" Internal &[(0, 2047)], ReadWrite OnCommand(38) 100 "fine search; taken at RFS START, which refuses 0",
    196 EndSwitchDistance "end switch distance" Microsteps ANY, Read Volatile 0 "after modes 2 and 3",
    197 LastReferencePosition "last reference position" Microsteps ANY, Read Volatile 0 "position just before it was zeroed (V1.20)",
    200 BoostCurrent "boost current" Current &[(0, 255)], ReadWrite OnCommand(39) 0 "while the speed changes, before 183 and 6; 0 = use 183 or 6",
    204 Freewheeling "freewheeling" TenMilliseconds &[(0, 65535)], ReadWrite OnCommand(40) 0 "0 = never; see also 150",
    206 ActualLoad "actual load value" Chip &[(0, 1023)], Read Volatile 0 "stallGuard2 reading",
    207 ExtendedErrorFlags "extended error flags" Bits &[(0, 3)], Read Volatile 0 "bit 0 stallGuard error, bit 1 deviation error; cleared when read or by the next motion command",
    208 DriverErrorFlags "TMC262 error flags" Bits &[(0, 255)], Read Volatile 0 "bits 0 SG, 1 OT, 2 OTPW, 3 S2GA, 4 S2GB, 5 OLA, 6 OLB, 7 STST",
    209 EncoderPosition "encoder position" Microsteps ANY, ReadWrite Volatile 0 "built-in sensOstep",
    210 EncoderPrescaler "encoder prescaler" Prescaler &[(0, i32::MAX)], ReadWrite OnCommand(41) 25600 "bit 2 is a special function: 4 clears the counter at the absolute zero point",
    212 MaximumEncoderDeviation "maximum encoder deviation" EncoderSteps &[(0, i32::MAX)], ReadWrite OnCommand(42) 0 "0 = off",
    214 PowerDownDelay "power down delay" TenMilliseconds &[(1, 65535)], ReadWrite OnCommand(43) 200 "standstill before the standby current",
    215 AbsoluteResolverValue "absolute resolver value" Turn1024 &[(0, 1023)], Read Volatile 0 "angle within one turn",
    216 ExternalEncoderPosition "external encoder position" Microsteps ANY, ReadWrite Volatile 0 "ABN encoder on the inputs",
    217 ExternalEncoderPrescaler "external encoder prescaler" Prescaler &[(0, i32::MAX)], ReadWrite OnCommand(44) 512 "bits 2..4 are special functions: 4 zero at the next N event, 8 with 4 at every N event, 16 polarity of N",
    218 MaximumExternalEncoderDeviation "maximum external encoder deviation" EncoderSteps &[(0, i32::MAX)], ReadWrite OnCommand(45) 0 "0 = off",
});

/// Global parameters of bank 0, read by GGP and written by SGP and AGP (manual section 5.1). Numbers 65 to 127 are
/// stored by the command that sets them.
pub static GLOBAL: Table<GlobalParameter> = Table::<GlobalParameter>::new(rows! { GlobalParameter;
    65 SerialBaudRate "RS485 baud rate" Choice &[(0, 8)], ReadWrite Automatic(2) 0 "0..8: 9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200, 230400 bit/s; takes effect after a restart",
    66 SerialAddress "serial address" Address &[(1, 255)], ReadWrite Automatic(3) 1 "module address on RS485",
    67 AsciiMode "ASCII mode" Bits &[(0, 63)], ReadWrite Automatic(4) 0 "bit 0 start in ASCII mode; bits 5 and 4: 00 echo each character, 01 echo the line after CR, 10 no echo",
    68 SerialHeartbeat "serial heartbeat" Milliseconds &[(0, 65535)], ReadWrite Automatic(5) 0 "motor stops when no RS485 or USB command arrives in this time; 0 = off",
    69 CanBitRate "CAN bit rate" Choice &[(2, 8)], ReadWrite Automatic(6) 8 "2..8: 20, 50, 100, 125, 250, 500, 1000 kbit/s; takes effect after a restart",
    70 CanReplyId "CAN reply ID" CanId &[(0, 2047)], ReadWrite Automatic(7) 2 "identifier of replies",
    71 CanId "CAN ID" CanId &[(0, 2047)], ReadWrite Automatic(8) 1 "identifier of requests",
    75 TelegramPause "telegram pause time" Milliseconds &[(0, 255)], ReadWrite Automatic(9) 0 "pause before the RS485 reply",
    76 SerialHostAddress "serial host address" Address &[(0, 255)], ReadWrite Automatic(10) 2 "reply address on RS485 and USB",
    77 AutoStart "auto start mode" Flag FLAG, ReadWrite Automatic(11) 0 "1 = start the TMCL program after power up",
    79 EndSwitchPolarity "end switch polarity" Flag FLAG, ReadWrite Automatic(12) 0 "1 = reverse polarity of the end switches; the home switch stays as it is",
    81 CodeProtection "TMCL code protection" Bits &[(0, 3)], ReadWrite Automatic(13) 0 "bit 0 against disassembling; bit 1 against overwriting; clearing bit 0 erases the program first",
    82 CanHeartbeat "CAN heartbeat" Milliseconds &[(0, 65535)], ReadWrite Automatic(14) 0 "motor stops when no CAN command arrives in this time; 0 = off",
    83 CanSecondaryId "CAN secondary address" CanId &[(0, 2047)], ReadWrite Automatic(15) 0 "0 = off",
    84 CoordinateStorage "coordinate storage" Flag FLAG, ReadWrite Automatic(16) 0 "1 = coordinates are always also stored in EEPROM (never coordinate 0)",
    85 DoNotRestoreVariables "do not restore user variables" Flag FLAG, ReadWrite Automatic(17) 0 "1 = user variables start at zero",
    87 SerialSecondaryAddress "serial secondary address" Address &[(0, 255)], ReadWrite Automatic(18) 0 "0 = off",
    90 ReverseShaft "reverse shaft" Flag FLAG, ReadWrite Automatic(19) 0 "motor and encoder direction",
    128 ApplicationStatus "TMCL application status" Choice &[(0, 3)], Read Volatile 0 "0 stop, 1 run, 2 step, 3 reset",
    129 DownloadMode "download mode" Flag FLAG, Read Volatile 0 "1 = commands are stored, not executed",
    130 ProgramCounter "TMCL program counter" Address ANY, Read Volatile 0 "address of the current command",
    132 TickTimer "TMCL tick timer" Milliseconds &[(0, i32::MAX)], ReadWrite Volatile 0 "counts up once per millisecond",
    133 RandomNumber "random number" Number &[(0, i32::MAX)], ReadWrite Volatile 0 "writing seeds the generator",
    255 SuppressReply "suppress reply" Flag FLAG, ReadWrite Volatile 0 "not stored; replies to GAP, GGP and GIO are never suppressed",
});

/// The TMCM-1140; the version is that of the manual this firmware follows.
pub static TMCM_1140: Spec = Spec {
    name: *b"1140",
    number: 1140,
    major: 1,
    minor: 42,
    usb: "TMCM-1140",
    axes: 1,
    inputs: 4,
    outputs: 2,
    analog: 0b1,
    analog_bits: CONVERTER_BITS,
    signals: &[Signal::Supply, Signal::Temperature, Signal::EncoderZero],
    pull_ups: 1,
    lacks: &[],
    limits_speed: false,
    axis: &AXIS,
    global: &GLOBAL,
    commands: 2048,
    slots: Some(SLOTS),
};

const SLOTS: Slots = Slots { variables: 20, axes: 76, each: 66, coordinates: 46 };

/// The TMCM-1140 as a type. Its EEPROM is an AT25128; the slots have room for a second axis.
#[derive(Clone, Copy, Debug)]
pub struct Tmcm1140;

impl Product for Tmcm1140 {
    const SPEC: &'static Spec = &TMCM_1140;
}

impl Memory for Tmcm1140 {
    const SIZE: usize = 16_384;
    const PAGE: usize = 64;
    const LAYOUT: Layout = Layout {
        tag: b"tmcm settings 2",
        defaults: const { &SLOTS.defaults::<208>(&AXIS, &GLOBAL) },
        after_erasing: 13,
        other: 16,
        storing: Storing::Pages,
    };
    type Program = [u8; 14_336];
    type Values = [i32; 224];
    type Pairs = [Pair; 16];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slots<F: Copy>(table: &Table<F>) -> Vec<(u8, u8)> {
        table.rows.iter().filter_map(|parameter| Some((parameter.row.number, parameter.row.slot()?))).collect()
    }

    /// Values lie in the EEPROM by slot number, so a parameter that changed its slot would be misread on every module
    /// in the field.
    #[test]
    fn storage_slots_are_frozen() {
        let axis = slots(&AXIS);
        assert!(axis.iter().map(|(_, slot)| *slot).eq(0..46));
        assert_eq!((axis[0], axis[9], axis[20]), ((4, 0), (149, 9), (167, 20)));
        assert_eq!(axis.last(), Some(&(218, 45)));
        let global = slots(&GLOBAL);
        assert!(global.iter().map(|(_, slot)| *slot).eq(2..20));
        let numbers: Vec<u8> = global.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, [65, 66, 67, 68, 69, 70, 71, 75, 76, 77, 79, 81, 82, 83, 84, 85, 87, 90]);
    }
}
