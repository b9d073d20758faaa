//! The TMCM-3110 with its TMCL firmware: three axes on one motion controller. Its parameters are those of the
//! TMCM-6110, and those of an ABN encoder for each axis, which has a counter of its own outside the motion controller.

use super::tmcm6110::{PAGES, SISTERS_PAGES, SLOTS, TMCM_6110};
use super::{tmcm1140, tmcm6110};
use crate::executor::{Product, Spec};
use crate::param::{ANY, AxisParameter, GlobalParameter, Table, derived};
use crate::store::{Layout, Memory, Pair, Storing};

/// Axis parameters. Slots count from the first slot of the axis.
pub static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(derived! { AxisParameter;
    of tmcm6110::AXIS.rows, without &[];
    201 EncoderMode "encoder mode" Bits &[(0, 65535)], ReadWrite OnCommand(46) 0 "its meaning is not published: stored, without effect",
    209 ExternalEncoderPosition "encoder position" Microsteps ANY, ReadWrite Volatile 0 "ABN encoder",
    210 ExternalEncoderPrescaler "encoder prescaler" Prescaler &[(0, i32::MAX)], ReadWrite OnCommand(44) 25600 "bits 2..4 are special functions: 4 zero at the next N event, 8 with 4 at every N event, 16 polarity of N",
    212 MaximumExternalEncoderDeviation "maximum encoder deviation" EncoderSteps &[(0, i32::MAX)], ReadWrite OnCommand(45) 0 "0 = off",
    254 StepDirectionMode "step/direction mode" Choice &[(0, 5)], ReadWrite OnCommand(47) 0 "stored, without effect",
});

/// Global parameters of bank 0: as on the TMCM-1140 there is one motion controller.
pub static GLOBAL: &Table<GlobalParameter> = &tmcm1140::GLOBAL;

/// The TMCM-3110. Version 1.14 is the one for which published host software was written.
pub static TMCM_3110: Spec = Spec {
    name: *b"3110",
    number: 3110,
    major: 1,
    minor: 14,
    usb: "TMCM-3110",
    axes: 3,
    pull_ups: 1,
    axis: &AXIS,
    global: GLOBAL,
    ..TMCM_6110
};

/// The TMCM-3110 as a type, with the same EEPROM as the TMCM-6110.
#[derive(Clone, Copy, Debug)]
pub struct Tmcm3110;

impl Product for Tmcm3110 {
    const SPEC: &'static Spec = &TMCM_3110;
}

impl Memory for Tmcm3110 {
    const SIZE: usize = 32_768;
    const PAGE: usize = 64;
    const LAYOUT: Layout = Layout {
        tag: b"tmcm 3110 settings 1",
        defaults: const { &SLOTS.defaults::<280>(&AXIS, GLOBAL) },
        after_erasing: 13,
        other: PAGES,
        storing: Storing::Pages,
    };
    type Program = [u8; 14_336];
    type Values = [i32; 280];
    type Pairs = [Pair; SISTERS_PAGES];
}
