//! An object of the node: the search for it, and the place of its value.

use core::cmp::Ordering;

use super::cia301::Description;
use super::cia301::abort::Abort;
use super::object::{Object, ROWS, Row};
use super::row::Storage;

/// Number of values in RAM.
pub(super) const CELLS: usize = LAID_OUT.1;

/// The value in RAM of each object, of those that each PDO has the first one.
const LAID_OUT: ([Option<u8>; ROWS.len()], usize) = lay_out();

/// Gives each object that is not computed a place in RAM. Evaluated by the compiler alone.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects)]
const fn lay_out() -> ([Option<u8>; ROWS.len()], usize) {
    let mut cells = [None; ROWS.len()];
    let (mut i, mut next) = (0, 0);
    while i < ROWS.len() {
        let row = &ROWS[i];
        assert!(row.first <= row.last && row.last - row.first < 4, "a PDO is none of four");
        if i > 0 {
            let before = &ROWS[i - 1];
            let follows = before.last < row.first || (before.last == row.last && before.sub < row.sub);
            assert!(follows, "indices and sub-indices do not ascend");
        }
        if !matches!(row.storage, Storage::Computed) {
            assert!(next < u8::MAX as usize, "too many values");
            cells[i] = Some(next as u8);
            next += row.count() as usize;
        }
        i += 1;
    }
    (cells, next)
}

/// An object of the node: one of the table, and the number of its PDO, counted from 0, if each PDO has one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The object.
    pub object: Object,
    /// The number of the PDO; 0 for an object of no PDO.
    pub nth: u8,
}

impl Entry {
    /// An object of no PDO, or of the first one.
    pub const fn of(object: Object) -> Self {
        Entry { object, nth: 0 }
    }

    /// The object at this index and sub-index.
    ///
    /// # Errors
    /// [`Abort::NoObject`] or [`Abort::NoSubIndex`].
    pub fn find(index: u16, sub: u8) -> Result<Self, Abort> {
        let order = |row: &Row| {
            if index < row.first {
                Ordering::Greater
            } else if index > row.last {
                Ordering::Less
            } else {
                row.sub.cmp(&sub)
            }
        };
        match ROWS.binary_search_by(order) {
            Ok(place) => {
                let (Some(object), Some(row)) = (Object::ALL.get(place), ROWS.get(place)) else {
                    return Err(Abort::NoObject);
                };
                Ok(Entry { object: *object, nth: index.wrapping_sub(row.first) as u8 })
            }
            Err(place) => {
                let near = [place.checked_sub(1), Some(place)].into_iter().flatten();
                let known = near.filter_map(|place| ROWS.get(place)).any(|row| (row.first..=row.last).contains(&index));
                Err(if known { Abort::NoSubIndex } else { Abort::NoObject })
            }
        }
    }

    /// The object at this index and sub-index, and what the services of CiA 301 have to know of it.
    ///
    /// # Errors
    /// [`Abort::NoObject`] or [`Abort::NoSubIndex`].
    pub(super) fn described(index: u16, sub: u8) -> Result<(Self, Description), Abort> {
        Entry::find(index, sub).map(|entry| (entry, entry.description()))
    }

    /// The facts about the object that the services of CiA 301 have to know.
    pub(super) fn description(self) -> Description {
        let Row { data, access, mapping, .. } = self.row();
        Description { size: data.size() as u8, access: *access, mapping: *mapping }
    }

    /// The row of the object.
    pub fn row(self) -> &'static Row {
        let [first, ..] = &ROWS;
        // Each object has a row.
        ROWS.get(self.object as usize).unwrap_or(first)
    }

    /// The place of the value in RAM; `None` if it is computed.
    pub(super) fn cell(self) -> Option<usize> {
        const CELL: &[Option<u8>] = &LAID_OUT.0;
        let first = (*CELL.get(self.object as usize)?)?;
        Some(usize::from(first).wrapping_add(self.nth.into()))
    }
}
