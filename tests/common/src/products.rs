//! Products other than the TMCM-1140: the TMCM-1110, those with several axes, and one with three axes that exists in
//! tests alone. Its parameters, commands and EEPROM are others than those of them all.

use hal_sim::board::{AbnPins, BoardKind, Input, TMCM_1110, TMCM_3110, TMCM_3212, TMCM_6110};
use hal_sim::chip::at25::AT25512;
use tmcm::module::{Product, Slots, Spec};
use tmcm::param::{ANY, AxisParameter, FLAG, GlobalParameter, Table};
use tmcm::parameter_rows;
use tmcm::product::{TMCM_1140, Tmcm1110, Tmcm3110, Tmcm3212, Tmcm6110};
use tmcm::store::{Layout, Memory, Pair, Storing};
use tmcm::tmcl::Opcode;
use tmcm_sim::native::{Tmc429s, Wired};

/// Axis parameters of the product with three axes. Number 204, the freewheeling time of the TMCM-1140, is the maximum
/// current here; number 210 is the standby current.
pub static THREE_AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(parameter_rows! { AxisParameter;
    0 TargetPosition "target position" Microsteps ANY, ReadWrite Volatile 0 "",
    1 ActualPosition "actual position" Microsteps ANY, ReadWrite Volatile 0 "",
    2 TargetSpeed "target speed" Internal &[(-2047, 2047)], ReadWrite Volatile 0 "",
    3 ActualSpeed "actual speed" Internal &[(-2047, 2047)], Read Volatile 0 "",
    4 MaximumSpeed "maximum speed" Internal &[(1, 2047)], ReadWrite OnCommand(0) 900 "",
    5 MaximumAcceleration "maximum acceleration" Internal &[(1, 2047)], ReadWrite OnCommand(1) 700 "",
    8 PositionReached "position reached flag" Flag FLAG, Read Volatile 0 "",
    9 HomeSwitch "home switch state" Flag FLAG, Read Volatile 0 "",
    10 RightSwitch "right limit switch state" Flag FLAG, Read Volatile 0 "",
    11 LeftSwitch "left limit switch state" Flag FLAG, Read Volatile 0 "",
    12 RightSwitchDisable "right limit switch disable" Flag FLAG, ReadWrite OnCommand(3) 1 "",
    13 LeftSwitchDisable "left limit switch disable" Flag FLAG, ReadWrite OnCommand(4) 1 "",
    130 MinimumSpeed "minimum speed" Internal &[(1, 2047)], ReadWrite OnCommand(2) 1 "",
    138 RampMode "ramp mode" Choice &[(0, 2)], ReadWrite Volatile 0 "",
    140 MicrostepResolution "microstep resolution" MicrostepExponent &[(0, 8)], ReadWrite OnCommand(9) 8 "",
    149 SoftStop "soft stop flag" Flag FLAG, ReadWrite OnCommand(10) 0 "",
    153 RampDivisor "ramp divisor" Exponent &[(0, 13)], ReadWrite OnCommand(5) 7 "",
    154 PulseDivisor "pulse divisor" Exponent &[(0, 13)], ReadWrite OnCommand(6) 3 "",
    162 ChopperBlankTime "chopper blank time" Choice &[(0, 3)], ReadWrite OnCommand(11) 2 "",
    165 ChopperHysteresisEnd "chopper hysteresis end" Chip &[(0, 15)], ReadWrite OnCommand(12) 2 "",
    166 ChopperHysteresisStart "chopper hysteresis start" Chip &[(0, 8)], ReadWrite OnCommand(13) 3 "",
    167 ChopperOffTime "chopper off time" Chip &[(0, 15)], ReadWrite OnCommand(14) 5 "",
    173 StallGuardFilter "stallGuard2 filter enable" Flag FLAG, ReadWrite OnCommand(15) 1 "",
    174 StallGuardThreshold "stallGuard2 threshold" Chip &[(-64, 63)], ReadWrite OnCommand(16) 5 "",
    181 StopOnStall "stop on stall" Internal &[(0, 2047)], ReadWrite OnCommand(17) 0 "",
    193 ReferenceSearchMode "reference search mode" Choice &[(1, 8), (65, 68)], ReadWrite OnCommand(18) 1 "",
    194 ReferenceSearchSpeed "reference search speed" Internal &[(0, 2047)], ReadWrite OnCommand(19) 500 "",
    195 ReferenceSwitchSpeed "reference switch speed" Internal &[(0, 2047)], ReadWrite OnCommand(20) 100 "",
    196 EndSwitchDistance "end switch distance" Microsteps ANY, Read Volatile 0 "",
    197 LastReferencePosition "last reference position" Microsteps ANY, Read Volatile 0 "",
    204 MaximumCurrent "maximum current" Current &[(0, 255)], ReadWrite OnCommand(7) 100 "",
    206 ActualLoad "actual load value" Chip &[(0, 1023)], Read Volatile 0 "",
    207 ExtendedErrorFlags "extended error flags" Bits &[(0, 3)], Read Volatile 0 "",
    208 DriverErrorFlags "driver error flags" Bits &[(0, 255)], Read Volatile 0 "",
    210 StandbyCurrent "standby current" Current &[(0, 255)], ReadWrite OnCommand(8) 16 "",
    214 PowerDownDelay "power down delay" TenMilliseconds &[(1, 65535)], ReadWrite OnCommand(21) 200 "",
    216 ExternalEncoderPosition "encoder position" Microsteps ANY, ReadWrite Volatile 0 "",
    217 ExternalEncoderPrescaler "encoder prescaler" Prescaler &[(0, i32::MAX)], ReadWrite OnCommand(22) 512 "",
    218 MaximumExternalEncoderDeviation "maximum encoder deviation" EncoderSteps &[(0, i32::MAX)], ReadWrite OnCommand(23) 0 "",
});

static THREE_GLOBAL: Table<GlobalParameter> = Table::<GlobalParameter>::new(parameter_rows! { GlobalParameter;
    66 SerialAddress "serial address" Address &[(1, 255)], ReadWrite Automatic(3) 1 "",
    68 SerialHeartbeat "serial heartbeat" Milliseconds &[(0, 65535)], ReadWrite Automatic(6) 0 "",
    76 SerialHostAddress "serial host address" Address &[(0, 255)], ReadWrite Automatic(4) 2 "",
    81 CodeProtection "code protection" Bits &[(0, 3)], ReadWrite Automatic(2) 0 "",
    84 CoordinateStorage "coordinate storage" Flag FLAG, ReadWrite Automatic(5) 0 "",
    128 ApplicationStatus "application status" Choice &[(0, 3)], Read Volatile 0 "",
    132 TickTimer "tick timer" Milliseconds &[(0, i32::MAX)], ReadWrite Volatile 0 "",
});

/// The product with three axes.
pub static THREE: Spec = Spec {
    name: *b"3003",
    number: 3003,
    axes: 3,
    inputs: 2,
    lacks: &[Opcode::Stgp, Opcode::EnterAscii],
    axis: &THREE_AXIS,
    global: &THREE_GLOBAL,
    commands: 6144,
    slots: Some(THREE_SLOTS),
    ..TMCM_1140
};

const THREE_SLOTS: Slots = Slots { variables: 7, axes: 63, each: 44, coordinates: 24 };

/// The board of the product with three axes. The home switches have pins that are no inputs of the product.
static THREE_BOARD: BoardKind = BoardKind {
    name: "board of three axes",
    controllers: &[3],
    inputs: &[Input::Free, Input::Free],
    outputs: 2,
    pull_ups: 1,
    full_current: 1_100,
    magnetic_encoders: false,
    abn: AbnPins::Own,
    eeprom: AT25512,
    ..TMCM_3110
};

/// The product with three axes, ABN encoders and an EEPROM of 64 KiB in pages of 128 bytes.
#[derive(Debug)]
pub struct Three;

impl Product for Three {
    const SPEC: &'static Spec = &THREE;
}

impl Memory for Three {
    const SIZE: usize = 65_536;
    const PAGE: usize = 128;
    const LAYOUT: Layout = Layout {
        tag: b"three",
        defaults: const { &THREE_SLOTS.defaults::<195>(&THREE_AXIS, &THREE_GLOBAL) },
        after_erasing: 2,
        other: 7,
        storing: Storing::Pages,
    };
    type Program = [u8; 43_008];
    type Values = [i32; 210];
    type Pairs = [Pair; 7];
}

impl Wired for Three {
    type Motion = Tmc429s;
}

/// A product with what its simulated board consists of.
pub trait OnBoard: Wired + Product {
    /// The parts of which the board consists.
    const BOARD: &'static BoardKind;
}

impl OnBoard for Three {
    const BOARD: &'static BoardKind = &THREE_BOARD;
}

impl OnBoard for Tmcm1110 {
    const BOARD: &'static BoardKind = &TMCM_1110;
}

impl OnBoard for Tmcm6110 {
    const BOARD: &'static BoardKind = &TMCM_6110;
}

impl OnBoard for Tmcm3110 {
    const BOARD: &'static BoardKind = &TMCM_3110;
}

impl OnBoard for Tmcm3212 {
    const BOARD: &'static BoardKind = &TMCM_3212;
}
