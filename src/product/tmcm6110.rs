//! The TMCM-6110 with its TMCL firmware: six axes on two motion controllers, without encoders. Of its parameters
//! numbers and names are published, and some ranges; where nothing is known they are those of the TMCM-1140, in the
//! same slots.

use super::tmcm1140::{self, TMCM_1140};
use crate::executor::ports::Signal;
use crate::executor::{Product, Slots, Spec};
use crate::param::{AxisParameter, GlobalParameter, Table, derived};
use crate::store::{Layout, Memory, Pair, Storing};

/// Numbers of the parameters of encoders.
const ENCODERS: &[u8] = &[209, 210, 212, 215, 216, 217, 218];

/// Axis parameters. Slots count from the first slot of the axis.
pub static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(derived! { AxisParameter;
    of tmcm1140::AXIS.rows, without ENCODERS;
    4 MaximumSpeed "maximum positioning speed" Internal &[(0, 2047)], ReadWrite OnCommand(0) 1000 "top speed of positioning ramps; 0: the motor stays where it is",
    5 MaximumAcceleration "maximum acceleration" Internal &[(0, 2047)], ReadWrite OnCommand(1) 1000 "reads back as written; velocity mode takes it as it is, so that with 0 the speed does not change. For positioning the motion controller gets the smallest value from there on that has a PMUL/PDIV pair, at least 2^(153 - 154 - 1) where parameter 4 is above 1448, and at most 2^(153 - 154 + 12) - 1",
    9 HomeSwitch "reference (home) switch state" Flag &[(0, 1)], Read Volatile 0 "logical state; which pin of the module it is, is not published",
    208 DriverErrorFlags "driver error flags" Bits &[(0, 255)], Read Volatile 0 "bits 0 SG, 1 OT, 2 OTPW, 3 S2GA, 4 S2GB, 5 OLA, 6 OLB, 7 STST",
    213 GroupIndex "group index" Number &[(0, 255)], ReadWrite Volatile 0 "axes with the same index also do what ROR, ROL, MST, MVP and RFS tell one of them; 0 = no group",
});

/// Global parameters of bank 0. The axes 0 to 2 are on one motion controller, and the axes 3 to 5 on another.
pub static GLOBAL: Table<GlobalParameter> = Table::<GlobalParameter>::new(derived! { GlobalParameter;
    of tmcm1140::GLOBAL.rows, without &[];
    79 EndSwitchPolarity "end switch polarity" Bits &[(0, 3)], ReadWrite Automatic(12) 0 "1 = reverse polarity of the end switches, bit 0 of axes 0..2, bit 1 of axes 3..5; the home switches stay as they are",
    90 ReverseShaft "reverse shaft" Bits &[(0, 3)], ReadWrite Automatic(19) 0 "direction of the motors, bit 0 of axes 0..2, bit 1 of axes 3..5",
});

/// The TMCM-6110. Version 1.46 is the last one of which a manual is known.
pub static TMCM_6110: Spec = Spec {
    name: *b"6110",
    number: 6110,
    major: 1,
    minor: 46,
    usb: "TMCM-6110",
    axes: 6,
    inputs: 8,
    outputs: 8,
    analog: 0b1_0001,
    signals: &[Signal::Supply, Signal::Temperature],
    pull_ups: 2,
    axis: &AXIS,
    global: &GLOBAL,
    slots: Some(SLOTS),
    ..TMCM_1140
};

/// The slots of this product and of the TMCM-3110: those of the TMCM-1140, and two more for each axis.
pub(super) const SLOTS: Slots = Slots { variables: 20, axes: 76, each: 68, coordinates: 48 };

/// Settings pages of this product, and of the TMCM-3110, whose EEPROM has the same size: one that has been used by the
/// other is cleared of it.
pub(super) const PAGES: usize = 35;
pub(super) const SISTERS_PAGES: usize = 20;

/// The TMCM-6110 as a type. Which EEPROM it has is not published: 32 KiB have room for the settings of six axes.
#[derive(Clone, Copy, Debug)]
pub struct Tmcm6110;

impl Product for Tmcm6110 {
    const SPEC: &'static Spec = &TMCM_6110;
}

impl Memory for Tmcm6110 {
    const SIZE: usize = 32_768;
    const PAGE: usize = 64;
    const LAYOUT: Layout = Layout {
        tag: b"tmcm 6110 settings 1",
        defaults: const { &SLOTS.defaults::<484>(&AXIS, &GLOBAL) },
        after_erasing: 13,
        other: SISTERS_PAGES,
        storing: Storing::Pages,
    };
    type Program = [u8; 14_336];
    type Values = [i32; 490];
    type Pairs = [Pair; PAGES];
}
