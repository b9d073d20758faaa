//! The description of a product: its [`Spec`], and as a type, [`Product`], the sizes of its memories.

use super::outcome::Outcome;
use super::ports::Signal;
use super::slots::Slots;
use crate::param::{AGAINST_READING, AxisParameter, GlobalParameter, Table};
use crate::store::{Array, Layout, Memory, Store};
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
    /// The slots of the EEPROM in which the settings are stored. `None` where the EEPROM is another firmware's: what
    /// would be stored there, or read from there, is refused with status 5.
    pub slots: Option<Slots>,
}

/// A product as a type: its data, and by [`Memory`] the sizes of its EEPROM and of the store's arrays.
pub trait Product: Memory {
    /// The data of the product.
    const SPEC: &'static Spec;
}

/// Number of bits of a reading of an analog input, on all boards.
pub const CONVERTER_BITS: u8 = 12;

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

    /// The version string of command 136, type 0: the name, `V`, and the three digits of the version.
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

/// Has the store write factory defaults to all settings. A read-protected program is erased, because the defaults take
/// its protection away.
pub fn factory_reset<P: Product>(store: &mut Store<P>) {
    let protection = store.get(P::LAYOUT.after_erasing).unwrap_or_default();
    store.reset(protection & AGAINST_READING != 0);
}

/// Stops the compiler where the data of a product contradict each other, or the number of axes that a module is made
/// with is another one.
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
