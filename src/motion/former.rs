//! The orders that an axis had before a command. A command that a chip does not take is refused, and then it has had no
//! effect. What the firmware wants is the former goal and profile again. Whatever the chips have taken of the other
//! one, they are told the former one as soon as they answer.

use super::axis::Axis;
use super::hardware::{Hardware, Known};
use super::orders::Orders;
use super::search::Search;

/// The orders that an axis had before a command.
#[derive(Clone, Copy, Debug)]
pub struct Former<S> {
    known: Known,
    search: Option<Search>,
    orders: Orders<S>,
}

impl<S> Default for Former<S> {
    fn default() -> Self {
        Former { known: Known::default(), search: None, orders: Orders::default() }
    }
}

impl<H: Hardware> Axis<H> {
    /// Notes what the axis has been told so far, before a command that may be [recalled](super::Joined::recall).
    #[inline(always)]
    pub fn note(&self, former: &mut Former<H::Shape>) {
        former.known = *self.hardware.known();
        former.orders = self.orders;
        // It is by far the largest, and seldom there.
        if self.search.is_some() || former.search.is_some() {
            former.search = self.search;
        }
    }
}

impl<S: Copy> Former<S> {
    /// Has the axis want again what it wanted before the command. Where the motor is and how fast it turns is no wish.
    #[inline(always)]
    pub(super) fn restore<H: Hardware<Shape = S>>(&self, axis: &mut Axis<H>) {
        let known = axis.hardware.known_mut();
        *known = Known { position: known.position, speed: known.speed, ..self.known };
        axis.orders = self.orders;
        axis.search = self.search;
    }
}
