//! The slot of each setting in the EEPROM. In ascending order: the store's own slots, the global parameters, the user
//! variables, and then, axis by axis, parameters and coordinates.

use crate::param::{AxisParameter, COORDINATES, GlobalParameter, STORED_USER_VARIABLES, Table};
use crate::store::FIRST_SLOT;

/// The slots of a product, but for those of the global parameters, which stand in the rows of their table.
#[derive(Clone, Copy, Debug)]
pub struct Slots {
    /// The slot of user variable 0.
    pub variables: usize,
    /// The first slot of axis 0.
    pub axes: usize,
    /// Number of slots of an axis. The slots in the rows of axis parameters count from the first of these.
    pub each: usize,
    /// The slot of coordinate 1, counted from the first slot of its axis. Coordinate 0 is not stored.
    pub coordinates: usize,
}

impl Slots {
    /// The slot of a user variable, if it can be stored.
    pub fn variable(&self, number: u8) -> Option<usize> {
        let number = usize::from(number);
        if number < STORED_USER_VARIABLES { self.variables.checked_add(number) } else { None }
    }

    /// The slot of an axis parameter.
    pub fn axis(&self, axis: u8, slot: u8) -> Option<usize> {
        usize::from(axis).checked_mul(self.each)?.checked_add(self.axes)?.checked_add(slot.into())
    }

    /// The slot of a coordinate, if it can be stored.
    pub fn coordinate(&self, axis: u8, number: u8) -> Option<usize> {
        let slot = u8::try_from(self.coordinates).ok()?.checked_add(number)?.checked_sub(1)?;
        if number > 0 && usize::from(number) < COORDINATES { self.axis(axis, slot) } else { None }
    }

    /// The factory defaults of `N` slots, with defaults for as many axes as these slots have room for. That may be more
    /// than the product has, where the layout of its EEPROM has had room for more since the first version.
    #[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
    pub const fn defaults<const N: usize>(
        &self,
        axis: &Table<AxisParameter>,
        global: &Table<GlobalParameter>,
    ) -> [i32; N] {
        let mut defaults = [0; N];
        let mut i = 0;
        while i < global.rows.len() {
            let row = &global.rows[i].row;
            if let Some(slot) = row.slot() {
                defaults[slot as usize] = row.default;
            }
            i += 1;
        }
        let mut first = self.axes;
        while first + self.each <= N {
            let mut i = 0;
            while i < axis.rows.len() {
                let row = &axis.rows[i].row;
                if let Some(slot) = row.slot() {
                    defaults[first + slot as usize] = row.default;
                }
                i += 1;
            }
            first += self.each;
        }
        defaults
    }

    /// Stops the compiler where two settings would share a slot, or `slots` are too few for the last axis.
    #[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
    pub(crate) const fn check(
        &self,
        axis: &Table<AxisParameter>,
        global: &Table<GlobalParameter>,
        axes: usize,
        slots: usize,
    ) {
        let mut i = 0;
        while i < global.rows.len() {
            if let Some(slot) = global.rows[i].row.slot() {
                let slot = slot as usize;
                assert!(
                    FIRST_SLOT <= slot && slot < self.variables,
                    "a global parameter has the slot of something else"
                );
            }
            i += 1;
        }
        let mut i = 0;
        while i < axis.rows.len() {
            if let Some(slot) = axis.rows[i].row.slot() {
                assert!((slot as usize) < self.coordinates, "an axis parameter has the slot of a coordinate");
            }
            i += 1;
        }
        assert!(self.variables + STORED_USER_VARIABLES <= self.axes, "user variables have slots of an axis");
        assert!(self.coordinates + COORDINATES - 1 <= self.each, "coordinates have slots of the next axis");
        assert!(self.axes + axes * self.each <= slots, "an axis has no slots");
    }
}
