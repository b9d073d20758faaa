//! A product as data: its [`Spec`], and as a type, [`Product`], for the sizes of its memories.

use super::outcome::Outcome;
use super::ports::Signal;
use super::slots::Slots;
use crate::param::{AGAINST_READING, AxisParameter, GlobalParameter, Table};
use crate::product::{tmcm1140, tmcm3110, tmcm3212, tmcm6110};
use crate::store::{Array, Layout, Memory, Pair, Store, Storing};
use crate::tmcl::{Command, Opcode, Reply, Status};
use crate::vm;

/// A product: everything in which one module differs from its sisters and that is not an algorithm.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// The first four characters of the version string.
    pub name: [u8; 4],
    /// The number of the product in the binary version reply.
    pub number: u16,
    /// Major version.
    pub major: u8,
    /// Minor version.
    pub minor: u8,
    /// The name of the USB device.
    pub usb: &'static str,
    /// Number of axes.
    pub axes: u8,
    /// Number of general purpose digital inputs.
    pub inputs: u8,
    /// Number of general purpose digital outputs.
    pub outputs: u8,
    /// Analog inputs: bit n is set if port n of bank 1 is one.
    pub analog: u8,
    /// Number of bits of the value of an analog input. The converter has [`CONVERTER_BITS`].
    pub analog_bits: u8,
    /// The signals that have ports of their own.
    pub signals: &'static [Signal],
    /// Number of groups of pull-up resistors; those of a group are switched together.
    pub pull_ups: u8,
    /// Commands that sisters have and this product lacks: they are answered with status 2.
    pub lacks: &'static [Opcode],
    /// Whether ROR and ROL limit a speed to the range of the parameter "target speed"; else they refuse one beyond it.
    pub limits_speed: bool,
    /// Axis parameters. A number without a row is answered with status 3.
    pub axis: &'static Table<AxisParameter>,
    /// Global parameters of bank 0.
    pub global: &'static Table<GlobalParameter>,
    /// How many commands program memory holds (manual section 3.3); 0 without one.
    pub commands: u16,
    /// The slots of the EEPROM in which the settings are stored. `None` where the EEPROM is another firmware's: what would be
    /// stored there, or read from there, is refused with status 5.
    pub slots: Option<Slots>,
}

/// A product as a type: its data, and by [`Memory`] the sizes of its EEPROM and of the store's arrays.
pub trait Product: Memory {
    /// The data of the product.
    const SPEC: &'static Spec;
}

/// Number of bits of a reading of an analog input, on all boards.
pub const CONVERTER_BITS: u8 = 12;

/// Number of axes of the TMCM-1140.
pub const TMCM_1140_AXES: usize = 1;

/// The TMCM-1140 with its TMCL firmware; the version is that of the manual this firmware follows.
pub static TMCM_1140: Spec = Spec {
    name: *b"1140",
    number: 1140,
    major: 1,
    minor: 42,
    usb: "TMCM-1140",
    axes: TMCM_1140_AXES as u8,
    inputs: 4,
    outputs: 2,
    analog: 0b1,
    analog_bits: CONVERTER_BITS,
    signals: &[Signal::Supply, Signal::Temperature, Signal::EncoderZero],
    pull_ups: 1,
    lacks: &[],
    limits_speed: false,
    axis: &tmcm1140::AXIS,
    global: &tmcm1140::GLOBAL,
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
        defaults: const { &SLOTS.defaults::<208>(&tmcm1140::AXIS, &tmcm1140::GLOBAL) },
        after_erasing: 13,
        other: 16,
        storing: Storing::Pages,
    };
    type Program = [u8; 14_336];
    type Values = [i32; 224];
    type Pairs = [Pair; 16];
}

/// Number of axes of the TMCM-6110.
pub const TMCM_6110_AXES: usize = 6;

/// The TMCM-6110 with its TMCL firmware: six axes on two motion controllers. Version 1.46 is the last one of which a manual
/// is known.
pub static TMCM_6110: Spec = Spec {
    name: *b"6110",
    number: 6110,
    major: 1,
    minor: 46,
    usb: "TMCM-6110",
    axes: TMCM_6110_AXES as u8,
    inputs: 8,
    outputs: 8,
    analog: 0b1_0001,
    signals: &[Signal::Supply, Signal::Temperature],
    pull_ups: 2,
    axis: &tmcm6110::AXIS,
    global: &tmcm6110::GLOBAL,
    slots: Some(SISTERS_SLOTS),
    ..TMCM_1140
};

/// Number of axes of the TMCM-3110.
pub const TMCM_3110_AXES: usize = 3;

/// The TMCM-3110 with its TMCL firmware: three axes on one motion controller. Version 1.14 is the one for which published
/// host software was written.
pub static TMCM_3110: Spec = Spec {
    name: *b"3110",
    number: 3110,
    major: 1,
    minor: 14,
    usb: "TMCM-3110",
    axes: TMCM_3110_AXES as u8,
    pull_ups: 1,
    axis: &tmcm3110::AXIS,
    global: tmcm3110::GLOBAL,
    ..TMCM_6110
};

/// Settings pages of the sisters, whose EEPROMs have the same size: one that has been used by the other is cleared of it.
const PAGES_6110: usize = 35;
const PAGES_3110: usize = 20;

/// The slots of both sisters: those of the TMCM-1140, and two more for each axis.
const SISTERS_SLOTS: Slots = Slots { variables: 20, axes: 76, each: 68, coordinates: 48 };

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
        defaults: const { &SISTERS_SLOTS.defaults::<484>(&tmcm6110::AXIS, &tmcm6110::GLOBAL) },
        after_erasing: 13,
        other: PAGES_3110,
        storing: Storing::Pages,
    };
    type Program = [u8; 14_336];
    type Values = [i32; 490];
    type Pairs = [Pair; PAGES_6110];
}

/// The TMCM-3110 as a type, with the same EEPROM.
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
        defaults: const { &SISTERS_SLOTS.defaults::<280>(&tmcm3110::AXIS, tmcm3110::GLOBAL) },
        after_erasing: 13,
        other: PAGES_6110,
        storing: Storing::Pages,
    };
    type Program = [u8; 14_336];
    type Values = [i32; 280];
    type Pairs = [Pair; PAGES_3110];
}

/// Number of axes of the TMCM-3212.
pub const TMCM_3212_AXES: usize = 3;

/// The TMCM-3212 with its TMCL firmware: three axes, each with a motion controller of its own. Version 1.05 is that of
/// the manual.
pub static TMCM_3212: Spec = Spec {
    name: *b"3212",
    number: 3212,
    major: 1,
    minor: 5,
    usb: "TMCM-3212",
    axes: TMCM_3212_AXES as u8,
    inputs: 4,
    outputs: 4,
    analog: 0b1111,
    analog_bits: 16,
    signals: &[Signal::Supply, Signal::Temperature, Signal::Enable],
    pull_ups: 0,
    lacks: &[Opcode::Stap, Opcode::Rsap, Opcode::EnterAscii],
    limits_speed: true,
    axis: &tmcm3212::AXIS,
    global: &tmcm3212::GLOBAL,
    commands: 6144,
    slots: Some(TMCM_3212_SLOTS),
};

/// The slots of the TMCM-3212: no axis parameters, only coordinates.
const TMCM_3212_SLOTS: Slots = Slots { variables: 20, axes: 76, each: 20, coordinates: 0 };

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
        defaults: const { &TMCM_3212_SLOTS.defaults::<136>(&tmcm3212::AXIS, &tmcm3212::GLOBAL) },
        after_erasing: 13,
        other: 5,
        storing: Storing::Pages,
    };
    type Program = [u8; TMCM_3212.commands as usize * Command::SIZE];
    type Values = [i32; 150];
    type Pairs = [Pair; 5];
}

impl Spec {
    /// The lowest and the highest speed of the parameter "target speed", which are those of ROR and ROL.
    ///
    /// # Panics
    /// The product has no such parameter, which a compiler notices.
    #[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
    pub(super) const fn speeds(&self) -> (i32, i32) {
        let mut i = 0;
        while self.axis.rows[i].function as u8 != AxisParameter::TargetSpeed as u8 {
            i += 1;
        }
        self.axis.rows[i].row.ranges[0]
    }

    /// Whether the product has an axis parameter of this function.
    #[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
    pub(super) const fn has(&self, function: AxisParameter) -> bool {
        let mut i = 0;
        while i < self.axis.rows.len() {
            if self.axis.rows[i].function as u8 == function as u8 {
                return true;
            }
            i += 1;
        }
        false
    }

    /// A value as an address in program memory. Outside of it the status is 4, without program memory 6.
    pub(crate) fn address(&self, value: i32) -> Result<u16, Status> {
        if self.commands == 0 {
            return Err(Status::NotAvailable);
        }
        vm::address(value, self.commands).ok_or(Status::InvalidValue)
    }

    /// Command 136: the version as a text (type 0) or as a number (type 1); other types are refused with status 3.
    pub(crate) fn version(&self, kind: u8) -> Result<Outcome, Status> {
        match kind {
            0 => Ok(Outcome::Special(Reply::Version(self.version_string()))),
            1 => Ok(Outcome::Value(self.version_number())),
            _ => Err(Status::WrongType),
        }
    }

    /// The version string of command 136, type 0: `1140V142`.
    pub fn version_string(&self) -> [u8; 8] {
        let digit = |n: u8| b'0'.saturating_add(n % 10);
        let [a, b, c, d] = self.name;
        [a, b, c, d, b'V', digit(self.major), digit(self.minor / 10), digit(self.minor)]
    }

    /// The version number of command 136, type 1: module number in the upper half, then major and minor.
    pub const fn version_number(&self) -> i32 {
        let [high, low] = self.number.to_be_bytes();
        i32::from_be_bytes([high, low, self.major, self.minor])
    }
}

/// Has the store write factory defaults to all settings. A read-protected program is erased, because the defaults take its
/// protection away.
pub fn factory_reset<P: Product>(store: &mut Store<P>) {
    let protection = store.get(P::LAYOUT.after_erasing).unwrap_or_default();
    store.reset(protection & AGAINST_READING != 0);
}

/// Stops the compiler where the data of a product contradict each other, or the number of axes that a module is made with
/// is another one.
#[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
pub(crate) const fn check<P: Product>(axes: usize) {
    let spec = P::SPEC;
    assert!(spec.axes as usize == axes, "the product has another number of axes");
    assert!(spec.commands as usize * Command::SIZE == P::Program::LENGTH, "program memory has another size");
    let Some(slots) = &spec.slots else { return };
    let Layout { defaults, after_erasing, .. } = P::LAYOUT;
    slots.check(spec.axis, spec.global, axes, defaults.len());
    let mut i = 0;
    while i < spec.global.rows.len() {
        let parameter = &spec.global.rows[i];
        if let (GlobalParameter::CodeProtection, Some(slot)) = (parameter.function, parameter.row.slot()) {
            assert!(slot as usize == after_erasing, "erasing a program is for parameter 81");
        }
        i += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The compiler evaluates the same function for each module, so what panics here does not compile there.
    #[test]
    fn a_module_has_as_many_axes_as_its_product() {
        check::<Tmcm1140>(1);
        assert!(std::panic::catch_unwind(|| check::<Tmcm1140>(2)).is_err());
    }

    /// Global parameters of the TMCM-1140 have slots up to 19, its axis parameters 46 slots.
    const GOOD: Slots = SLOTS;

    fn complaint(slots: Slots, axes: usize, count: usize) -> Option<String> {
        let panic = std::panic::catch_unwind(|| slots.check(&tmcm1140::AXIS, &tmcm1140::GLOBAL, axes, count)).err()?;
        Some(panic.downcast_ref::<&str>().copied().unwrap_or_default().to_owned())
    }

    /// The compiler evaluates the same function for each product, so what panics here does not compile there.
    #[test]
    fn settings_without_a_slot_of_their_own_are_refused() {
        assert_eq!(complaint(GOOD, 1, 142), None);
        assert_eq!(complaint(GOOD, 2, 208), None);
        for (slots, axes, count, reason) in [
            (GOOD, 1, 141, "an axis has no slots"),
            (GOOD, 3, 208, "an axis has no slots"),
            (Slots { variables: 19, ..GOOD }, 1, 208, "a global parameter has the slot of something else"),
            (Slots { coordinates: 45, ..GOOD }, 1, 208, "an axis parameter has the slot of a coordinate"),
            (Slots { axes: 75, ..GOOD }, 1, 208, "user variables have slots of an axis"),
            (Slots { each: 65, ..GOOD }, 1, 208, "coordinates have slots of the next axis"),
        ] {
            assert_eq!(complaint(slots, axes, count).as_deref(), Some(reason), "{slots:?}");
        }
    }
}
