//! The TMCM-1110 (stepRocker) with its TMCL firmware: one axis on one motion controller, and an ABN encoder on pins of
//! its own. Its manual is older than that of the TMCM-1140: it has fewer parameters, and no ASCII mode.

use super::tmcm1140::{self, TMCM_1140};
use crate::executor::ports::Signal;
use crate::executor::{Product, Slots, Spec};
use crate::param::{ANY, AxisParameter, FLAG, GlobalParameter, Table, derived};
use crate::store::{Layout, Memory, Pair, Storing};
use crate::tmcl::Opcode;

/// Numbers of axis parameters that are newer than the manual, and those of a second encoder.
const NEWER_OF_AXIS: &[u8] = &[150, 200, 207, 215, 216, 217, 218];
/// Numbers of global parameters that are newer than the manual, and that of ASCII mode.
const NEWER: &[u8] = &[67, 87, 90, 255];

/// Axis parameters (manual chapter 5). Parameters 12, 13, 141 and 149 stand in its section 5.3 alone, 184 in its first
/// note. Parameter 197, and the modes 65..68 of 193, are here because existing host software uses them. Slots count
/// from the first slot of the axis.
pub static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(derived! { AxisParameter;
    of tmcm1140::AXIS.rows, without NEWER_OF_AXIS;
    4 MaximumSpeed "maximum positioning speed" Internal &[(0, 2047)], ReadWrite OnCommand(0) 1000 "top speed of positioning ramps; 0: the motor stays where it is",
    5 MaximumAcceleration "maximum acceleration" Internal &[(0, 2047)], ReadWrite OnCommand(1) 1000 "reads back as written; velocity mode takes it as it is, so that with 0 the speed does not change. For positioning the motion controller gets the smallest value from there on that has a PMUL/PDIV pair, at least 2^(153 - 154 - 1) where parameter 4 is above 1448, and at most 2^(153 - 154 + 12) - 1",
    9 HomeSwitch "reference switch state" Flag FLAG, Read Volatile 0 "logical state of the home switch",
    130 MinimumSpeed "minimum speed" Internal &[(0, 2047)], ReadWrite OnCommand(6) 1 "stop speed; with another one than 1 a move may not end exactly at its target",
    141 ReferenceTolerance "reference switch tolerance" Microsteps &[(0, 4095)], ReadWrite OnCommand(8) 0 "DX_REF_TOLERANCE of the TMC429",
    163 ConstantToffMode "chopper mode" Choice FLAG, ReadWrite OnCommand(16) 0 "0 spreadCycle, 1 constant off time; switches the meaning of 165 and 166",
    164 ChopperHysteresisDecrement "chopper hysteresis decrement" Choice &[(0, 3)], ReadWrite OnCommand(17) 0 "16, 32, 48, 64 clocks; only in spreadCycle",
    165 ChopperHysteresisEnd "chopper hysteresis end" Chip &[(0, 15)], ReadWrite OnCommand(18) 2 "0..15 are the hysteresis ends -3..12; in constant off time mode the fast decay time",
    166 ChopperHysteresisStart "chopper hysteresis start" Chip &[(0, 8)], ReadWrite OnCommand(19) 3 "an offset to the hysteresis end; 8 does not fit the three bits of HSTRT: the chip gets 7; the parameter reads back 8. In constant off time mode the sine wave offset",
    167 ChopperOffTime "chopper off time" Chip &[(0, 0), (2, 15)], ReadWrite OnCommand(20) 5 "0 switches the driver bridges off (motor freewheels)",
    179 Vsense "Vsense" Flag FLAG, ReadWrite OnCommand(10) 1 "full scale at 0: 1/18, 1: 1/36 VDD; not to be changed",
    197 LastReferencePosition "last reference position" Microsteps ANY, Read Volatile 0 "position just before it was zeroed; not in the V1.03 manual, but host software reads it",
    209 ExternalEncoderPosition "encoder position" Microsteps ANY, ReadWrite Volatile 0 "ABN encoder",
    210 ExternalEncoderPrescaler "encoder prescaler" Prescaler &[(0, i32::MAX)], ReadWrite OnCommand(44) 25600 "bits 2..4 are special functions: 4 zero at the next N event, 8 with 4 at every N event, 16 polarity of N",
    212 MaximumExternalEncoderDeviation "maximum encoder deviation" EncoderSteps &[(0, 65535)], ReadWrite OnCommand(45) 0 "0 = off",
    254 StepDirectionMode "step/direction mode" Choice FLAG, ReadWrite OnCommand(41) 0 "stored, without effect",
});

/// Global parameters of bank 0 (manual section 6.1). Parameter 79 is here because existing host software reads it.
pub static GLOBAL: Table<GlobalParameter> = Table::<GlobalParameter>::new(derived! { GlobalParameter;
    of tmcm1140::GLOBAL.rows, without NEWER;
    64 EepromMagic "EEPROM magic" Number &[(0, 255)], ReadWrite Automatic(4) 228 "with another value than 228 all settings are factory defaults after the next start, this one too",
    65 SerialBaudRate "RS485 baud rate" Choice &[(0, 11)], ReadWrite Automatic(2) 0 "0..11: 9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200, 230400, 250000, 500000, 1000000 bit/s; takes effect after a restart",
    66 SerialAddress "serial address" Address &[(0, 255)], ReadWrite Automatic(3) 1 "module address on RS485",
    73 EepromLock "configuration EEPROM lock flag" Choice &[(0, 1), (1234, 1234), (4321, 4321)], ReadWrite Automatic(18) 0 "written 1234 locks, 4321 unlocks; reads 1 locked, 0 unlocked, which can be written as well. While locked, nothing else can be stored: status 5",
    79 EndSwitchPolarity "end switch polarity" Flag FLAG, ReadWrite Automatic(12) 0 "1 = reverse polarity of the end switches; the home switch stays as it is; not in the V1.03 manual, but host software reads it",
    86 StepPulseLength "step pulse length" Choice &[(0, 15)], ReadWrite Automatic(19) 0 "0 = 1 microsecond; of the step outputs, to which nothing is connected: stored, without effect",
    133 RandomNumber "random number" Number &[(0, i32::MAX)], Read Volatile 0 "another one each time",
});

/// The TMCM-1110; the version is that of the manual.
pub static TMCM_1110: Spec = Spec {
    name: *b"1110",
    number: 1110,
    major: 1,
    minor: 3,
    usb: "TMCM-1110",
    outputs: 5,
    signals: &[Signal::SupplyReading, Signal::LogicSupplyReading],
    pull_ups: 0,
    lacks: &[Opcode::EnterAscii],
    axis: &AXIS,
    global: &GLOBAL,
    slots: Some(SLOTS),
    ..TMCM_1140
};

const SLOTS: Slots = Slots { variables: 20, axes: 76, each: 66, coordinates: 46 };

/// The TMCM-1110 as a type. Which EEPROM it has is not published: in an AT25128 the 2048 commands of the firmware
/// manual leave as much room for settings as on the TMCM-1140.
#[derive(Clone, Copy, Debug)]
pub struct Tmcm1110;

impl Product for Tmcm1110 {
    const SPEC: &'static Spec = &TMCM_1110;
}

impl Memory for Tmcm1110 {
    const SIZE: usize = 16_384;
    const PAGE: usize = 64;
    const LAYOUT: Layout = Layout {
        tag: b"tmcm 1110 settings 1",
        defaults: const { &SLOTS.defaults::<142>(&AXIS, &GLOBAL) },
        after_erasing: 13,
        other: 16,
        storing: Storing::Pages,
    };
    type Program = [u8; 14_336];
    type Values = [i32; 154];
    type Pairs = [Pair; 11];
}
