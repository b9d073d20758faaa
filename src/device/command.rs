//! Commands to axes: what a chip does not take of one leaves nothing behind, on no axis.

use super::line::Lines;
use super::{Board, Device};
use crate::motion::{Axis, Error, Former, Hardware, Joined};

/// What a device was told before a command.
pub struct Before<T: Board, const AXES: usize> {
    axes: [Former<<T::Hardware as Hardware>::Shape>; AXES],
    lines: Lines<AXES>,
}

impl<T: Board, const AXES: usize> Device<T, AXES> {
    /// Notes what the device was told before a command to axes, for [`settle`](Self::settle) after it.
    #[inline(never)]
    pub fn before(&self) -> Before<T, AXES> {
        Before { axes: self.axes.each_ref().map(Axis::former), lines: self.lines }
    }

    /// Ends a command that axes, axis n in bit n of `axes`, were `told`: they take all of it or nothing. If a chip did not
    /// take its part, these axes and those on a line with them are on their former courses again, and their chips are told so.
    ///
    /// # Errors
    /// That of `told`.
    pub fn settle(&mut self, axes: u8, before: &Before<T, AXES>, told: Result<(), Error>) -> Result<(), Error> {
        if told == Err(Error::Chip) {
            self.recall(axes, before);
        }
        told
    }

    #[inline(never)]
    fn recall(&mut self, axes: u8, before: &Before<T, AXES>) {
        self.lines = before.lines;
        for (number, former) in before.axes.iter().enumerate() {
            let is_touched = is_in(axes, number) || self.is_on_line(number);
            if let Some(mut axis) = self.axis(number).filter(|_| is_touched) {
                axis.recall(former);
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
