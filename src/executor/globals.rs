//! The settings among the global parameters of bank 0 (manual section 5.1).

use super::Product;
use crate::device::Inversion;
use crate::param::{AGAINST_READING, GlobalParameter as G, Parameter};
use crate::store::Store;
use crate::tmcl::Opcode;

/// The number of their bank.
pub(crate) const SETTINGS: u8 = 0;

/// The values of the settings as they were set last.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Globals([i32; G::SETTINGS]);

impl Globals {
    /// The defaults of a product.
    #[inline(always)]
    pub(super) fn defaults<P: Product>() -> Self {
        Globals(P::SPEC.global.defaults())
    }

    /// The value of a setting; 0 for a parameter that is none.
    pub(crate) fn get(&self, parameter: G) -> i32 {
        self.0.get(parameter.index()).copied().unwrap_or_default()
    }

    /// The value of the setting with a number; `None` if the product has no such setting. GGP of hosts tries this
    /// first, as it needs no call: a reply comes 36 cycles earlier.
    #[inline(always)]
    pub(crate) fn setting<P: Product>(&self, number: u8) -> Option<i32> {
        self.0.get(P::SPEC.global.find(number)?.function.index()).copied()
    }

    /// Sets a setting; of a parameter that is none nothing is kept.
    pub(crate) fn set(&mut self, parameter: G, value: i32) {
        if let Some(cell) = self.0.get_mut(parameter.index()) {
            *cell = value;
        }
    }

    /// Takes the stored settings from the store.
    pub(crate) fn reload<P: Product>(&mut self, store: &Store<P>) {
        for Parameter { function, row } in P::SPEC.global.rows {
            let value = row.slot().and_then(|slot| store.get(slot.into()));
            if let Some(value) = value.filter(|value| row.accepts(*value)) {
                self.set(*function, value);
            }
        }
    }

    /// Switch polarity (79) and shaft direction (90): bit n of each parameter is for motion controller n.
    pub(crate) fn inversion(&self) -> Inversion {
        Inversion { switches: self.get(G::EndSwitchPolarity) as u8, shafts: self.get(G::ReverseShaft) as u8 }
    }

    /// True if parameter 255 suppresses the reply to this command. Commands that read a value are always answered
    /// (manual section 5.1).
    pub(crate) fn suppress(&self, opcode: u8) -> bool {
        const READ: [u8; 3] = [Opcode::Gap as u8, Opcode::Ggp as u8, Opcode::Gio as u8];
        self.get(G::SuppressReply) != 0 && !READ.contains(&opcode)
    }

    /// True if parameter 81 protects the program against what the bits of `against` stand for.
    pub(crate) fn protect(&self, against: i32) -> bool {
        self.get(G::CodeProtection) & against != 0
    }

    /// True if writing this value to parameter 81 takes the read protection off, so that the program is erased.
    pub(super) fn uncover(&self, protection: i32) -> bool {
        self.protect(AGAINST_READING) && protection & AGAINST_READING == 0
    }
}
