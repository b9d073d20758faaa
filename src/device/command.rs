//! Commands to axes: what a chip does not take of one leaves nothing behind, on no axis.

use core::array;

use super::interpolation::Interpolations;
use super::{Circuit, Device, ShapeOf};
use crate::motion::{Error, Former, Joined};

/// The orders that a device had before a command to axes.
pub(super) struct Before<T: Circuit, const AXES: usize> {
    axes: [Former<ShapeOf<T>>; AXES],
    interpolations: Interpolations<AXES>,
}

impl<T: Circuit, const AXES: usize> Default for Before<T, AXES> {
    fn default() -> Self {
        Before { axes: array::from_fn(|_| Former::default()), interpolations: Interpolations::default() }
    }
}

impl<T: Circuit, const AXES: usize> Device<T, AXES> {
    /// Carries out a command to axes, axis n in bit n of `axes`, by telling it the chips: they take all of it or
    /// nothing. If a chip does not take its part, these axes and those that were on a line are on the way to their
    /// former goals again. Their chips are told so.
    ///
    /// # Errors
    /// That of `tell`.
    pub fn command(&mut self, axes: u8, tell: impl FnOnce(&mut Self) -> Result<(), Error>) -> Result<(), Error> {
        self.note(axes);
        let told = tell(self);
        if told == Err(Error::Chip) {
            self.recall(axes);
        }
        told
    }

    #[inline(never)]
    fn note(&mut self, axes: u8) {
        if AXES > 1 {
            self.before.interpolations = self.interpolations;
        }
        for number in 0..AXES {
            let is_concerned = is_in(axes, number) || self.is_interpolated(number);
            if let (Some(axis), Some(former), true) =
                (self.axes.get(number), self.before.axes.get_mut(number), is_concerned)
            {
                axis.note(former);
            }
        }
    }

    #[inline(never)]
    fn recall(&mut self, axes: u8) {
        if AXES > 1 {
            self.interpolations = self.before.interpolations;
        }
        for number in 0..AXES {
            let is_concerned = is_in(axes, number) || self.is_interpolated(number);
            let Some(former) = self.before.axes.get(number).filter(|_| is_concerned).copied() else { continue };
            if let Some(mut axis) = self.axis(number) {
                axis.recall(&former);
            }
        }
    }

    /// Tells axes the same, axis n in bit n of `axes`, one after the other until one does not take it.
    ///
    /// # Errors
    /// That of the first axis which has not taken it.
    pub fn tell_each(
        &mut self,
        axes: u8,
        tell: impl Fn(&mut Joined<'_, T::Hardware>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut of_axes = (0..AXES).filter(|number| is_in(axes, *number));
        of_axes.try_for_each(|number| self.axis(number).map_or(Ok(()), |mut axis| tell(&mut axis)))
    }
}

/// True if an axis is one of those whose bits are set.
const fn is_in(axes: u8, number: usize) -> bool {
    axes.unbounded_shr(number as u32) & 1 != 0
}
