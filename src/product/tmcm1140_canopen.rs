//! The TMCM-1140 with the CANopen firmware.

use super::tmcm1140::{TMCM_1140, Tmcm1140};
use crate::canopen::{DEFAULTS, UNUSED};
use crate::executor::{Product, Spec};
use crate::store::{Layout, Memory, Pair, Storing};

/// The product as the executor of TMCL mode (2700h) knows it; the version is that of the node. There is no program
/// memory, and the EEPROM is the node's.
static SPEC: Spec = Spec { major: 3, minor: 20, commands: 0, slots: None, ..TMCM_1140 };

/// The TMCM-1140 with the CANopen firmware, as a type. The settings of the TMCL firmware have the same place with
/// another tag: they count as foreign and are left alone until something is saved.
#[derive(Clone, Copy, Debug)]
pub struct Tmcm1140Canopen;

impl Product for Tmcm1140Canopen {
    const SPEC: &'static Spec = &SPEC;
}

impl Memory for Tmcm1140Canopen {
    const SIZE: usize = Tmcm1140::SIZE;
    const PAGE: usize = Tmcm1140::PAGE;
    const LAYOUT: Layout = Layout {
        tag: b"tmcm canopen 1",
        defaults: &DEFAULTS,
        after_erasing: UNUSED,
        other: 16,
        storing: Storing::Epochs { pages: UNUSED, other: Tmcm1140::LAYOUT.tag },
    };
    type Program = [u8; 0];
    type Values = [i32; 224];
    type Pairs = [Pair; 16];
}
