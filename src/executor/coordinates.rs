//! Coordinates: positions that have a number, for MVP COORD (manual sections 3.7.24 to 3.7.27).

use super::commands::slots;
use super::{Commands, Outcome, Product, Undo};
use crate::device::Circuit;
use crate::param::{COORDINATES, GlobalParameter as G};
use crate::store::Need;
use crate::tmcl::Status;

/// The coordinates of each axis in RAM, in microsteps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coordinates<const AXES: usize>([[i32; COORDINATES]; AXES]);

impl<const AXES: usize> Default for Coordinates<AXES> {
    fn default() -> Self {
        Coordinates([[0; COORDINATES]; AXES])
    }
}

impl<const AXES: usize> Coordinates<AXES> {
    /// A coordinate of an axis. If there is no such axis or coordinate, the status is 4.
    pub(super) fn get(&self, axis: u8, number: u8) -> Result<i32, Status> {
        let of_axis = self.0.get(usize::from(axis)).ok_or(Status::InvalidValue)?;
        of_axis.get(usize::from(number)).copied().ok_or(Status::InvalidValue)
    }

    /// Sets a coordinate of an axis, and returns what it was. If there is no such axis or coordinate, the status is 4.
    fn set(&mut self, axis: u8, number: u8, value: i32) -> Result<i32, Status> {
        let of_axis = self.0.get_mut(usize::from(axis)).ok_or(Status::InvalidValue)?;
        let cell = of_axis.get_mut(usize::from(number)).ok_or(Status::InvalidValue)?;
        Ok(core::mem::replace(cell, value))
    }

    /// Takes back what a command has set.
    pub(crate) fn undo(&mut self, Undo { axis, number, value }: Undo) {
        // The command has found this coordinate.
        let _ = self.set(axis, number, value);
    }

    /// Sets each coordinate to its stored value, which `stored` tells by axis and number, or to 0 if there is none.
    pub(super) fn restore(&mut self, stored: impl Fn(u8, u8) -> Option<i32>) {
        for (axis, coordinates) in (0..=u8::MAX).zip(&mut self.0) {
            for (number, coordinate) in (0..=u8::MAX).zip(coordinates) {
                *coordinate = stored(axis, number).unwrap_or_default();
            }
        }
    }
}

impl<T: Circuit<Product: Product>, const AXES: usize> Commands<'_, T, AXES> {
    /// SCO, CCO and ACO: sets a coordinate of one axis, in RAM, and in the EEPROM where parameter 84 says so. Never
    /// inlined: other commands would save what this one needs.
    #[inline(never)]
    pub(super) fn set_coordinate(&mut self, number: u8, axis: u8, value: i32, echo: i32) -> Result<Outcome, Status> {
        let stores = self.executor.globals.get(G::CoordinateStorage) != 0;
        if stores {
            self.may_store()?;
        }
        let before = self.executor.coordinates.set(axis, number, value)?;
        if stores {
            // Coordinate 0 has no slot in the EEPROM.
            if number > 0 {
                self.keep(slots::<T::Product>()?.coordinate(axis, number), value)?;
            }
            let undo = Some(Undo { axis, number, value: before });
            return Ok(Outcome::Stored { value: echo, need: Need::Settings, undo });
        }
        Ok(Outcome::Value(echo))
    }

    /// SCO with motor 255: stores one coordinate of each axis, or, with number 0, all of them.
    pub(super) fn store_coordinates(&mut self, number: u8, echo: i32) -> Result<Outcome, Status> {
        for (axis, number) in selection::<AXES>(number)? {
            let value = self.executor.coordinates.get(axis, number)?;
            self.keep(slots::<T::Product>()?.coordinate(axis, number), value)?;
        }
        Ok(Outcome::stored(echo))
    }

    /// GCO with motor 255: restores one stored coordinate of each axis, or, with number 0, all of them.
    pub(super) fn restore_coordinates(&mut self, number: u8, echo: i32) -> Result<Outcome, Status> {
        for (axis, number) in selection::<AXES>(number)? {
            let value = self.recall(slots::<T::Product>()?.coordinate(axis, number))?;
            self.executor.coordinates.set(axis, number, value)?;
        }
        Ok(Outcome::Value(echo))
    }
}

/// The coordinates, as axis and number, that a command with motor 255 means: one of 1..=20, or all of them by 0, of
/// every axis.
fn selection<const AXES: usize>(number: u8) -> Result<impl Iterator<Item = (u8, u8)>, Status> {
    let (first, last) = match number {
        0 => (1, (COORDINATES as u8).saturating_sub(1)),
        one if usize::from(one) < COORDINATES => (one, one),
        _ => return Err(Status::InvalidValue),
    };
    Ok((0..AXES as u8).flat_map(move |axis| (first..=last).map(move |number| (axis, number))))
}
