//! What an axis was told before a command. A command that a chip does not take is refused, and then it has had no effect: what
//! the firmware wants is the former course again, and whatever the chips have taken of the other one, they are told the former
//! one as soon as they answer.

use super::axis::{Axis, Joined};
use super::hardware::{Hardware, Known};
use super::orders::{Orders, Untold};
use super::search::Search;

/// What an axis was told before a command.
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
    /// Notes what the axis has been told so far, before a command that may be [recalled](Joined::recall).
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

impl<H: Hardware> Joined<'_, H> {
    /// Has the axis be what it was when it [was noted](Axis::note), before a command that has been refused: the motor goes on to
    /// its former goal. The chips are told so now, and what they do not take, with each poll.
    #[inline(never)]
    pub fn recall(&mut self, former: &Former<H::Shape>) {
        let known = self.hardware.known_mut();
        *known = Known { position: known.position, speed: known.speed, ..former.known };
        self.orders = former.orders;
        self.search = former.search;
        self.set_pace(self.orders.pace);
        // The next poll that gets so far gives the motor its former current.
        self.excitation = None;
        self.untold = self.untold.max(Untold::Course);
        // What fails now is done by the polls.
        let _ = self.catch_up();
    }
}
