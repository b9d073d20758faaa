//! Where each setting lives: what the program is worth, global parameters, user variables, then every axis with its parameters and its
//! coordinates.

use super::page::{PAGES, VALUES};
use crate::param::{AxisParameter, COORDINATES, GlobalParameter, STORED_USER_VARIABLES};

/// Axes the settings area has room for.
pub const AXES_MAX: usize = (PAGES * VALUES - COMMON) / PER_AXIS;

const COMMON: usize = OF_PROGRAM + GlobalParameter::STORED + STORED_USER_VARIABLES;
/// They are in the first page, which a factory reset writes.
const OF_PROGRAM: usize = 2;
/// Coordinate 0 is not stored.
const PER_AXIS: usize = AxisParameter::STORED + COORDINATES - 1;

/// Something that can be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// What program memory is worth.
    ProgramState,
    /// Its check sum.
    ProgramSum,
    /// A global parameter of bank 0.
    Global(GlobalParameter),
    /// A user variable, 0..=55.
    Variable(u8),
    /// A parameter of an axis.
    Axis(u8, AxisParameter),
    /// A coordinate of an axis, 1..=20.
    Coordinate(u8, u8),
}

impl Slot {
    /// Page and index within it; `None` for what is not stored.
    pub(super) fn place(self) -> Option<(usize, usize)> {
        let of_axis = |axis: u8, index: usize| {
            let axis = usize::from(axis);
            let first = axis.checked_mul(PER_AXIS)?.checked_add(COMMON)?;
            if axis < AXES_MAX { first.checked_add(index) } else { None }
        };
        let slot = match self {
            Slot::ProgramState => 0,
            Slot::ProgramSum => 1,
            Slot::Global(parameter) => parameter.stored_index()?.checked_add(OF_PROGRAM)?,
            Slot::Variable(number) => {
                let number = usize::from(number);
                (number < STORED_USER_VARIABLES).then_some(number.checked_add(OF_PROGRAM + GlobalParameter::STORED)?)?
            }
            Slot::Axis(axis, parameter) => of_axis(axis, parameter.stored_index()?)?,
            Slot::Coordinate(axis, number) => {
                let number = usize::from(number);
                (1..COORDINATES).contains(&number).then_some(())?;
                of_axis(axis, number.checked_sub(1)?.checked_add(AxisParameter::STORED)?)?
            }
        };
        Some((slot / VALUES, slot % VALUES))
    }

    /// Value after a factory reset.
    pub(super) fn default(self) -> i32 {
        match self {
            Slot::Global(parameter) => parameter.row().default,
            Slot::Axis(_, parameter) => parameter.row().default,
            Slot::ProgramState | Slot::ProgramSum | Slot::Variable(_) | Slot::Coordinate(..) => 0,
        }
    }

    /// Every slot there is.
    pub(super) fn all() -> impl Iterator<Item = Slot> {
        let variables = (0..STORED_USER_VARIABLES as u8).map(Slot::Variable);
        let axes = (0..AXES_MAX as u8).flat_map(|axis| {
            let parameters = AxisParameter::ALL.iter().map(move |p| Slot::Axis(axis, *p));
            parameters.chain((1..COORDINATES as u8).map(move |n| Slot::Coordinate(axis, n)))
        });
        let globals = GlobalParameter::ALL.iter().map(|p| Slot::Global(*p));
        [Slot::ProgramState, Slot::ProgramSum].into_iter().chain(globals).chain(variables).chain(axes)
    }
}
