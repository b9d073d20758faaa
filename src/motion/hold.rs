//! Whether a stop switch holds the motor, which shows in a motor that is to turn and does not.

use super::hardware::Known;
use super::switch::{SETTLED, SETTLED_ON_LINE};

/// The findings of the polls about a motor that may be held by a stop switch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Hold {
    /// Number of polls, one in a millisecond, for which a stop switch has held the motor; 255 stands for any more.
    polls: u8,
    /// The motor is on a straight line or rotates, and was last seen turn so fast that it is somewhere else in each
    /// poll.
    brisk: bool,
}

impl Hold {
    /// True while a stop switch holds the motor, as the last poll has found.
    pub(super) const fn holds(&self) -> bool {
        self.polls > 0
    }

    /// True if a stop switch has held the motor for so long that its contacts have ceased to bounce. For a motor that
    /// is `on_line`, on a straight line with others, two polls are long enough.
    pub(super) const fn has_settled(&self, on_line: bool) -> bool {
        self.polls >= if on_line { SETTLED_ON_LINE } else { SETTLED }
    }

    /// Takes in what a poll has read of a motor that is to turn in the direction `ahead`. True if the motor stays where
    /// the poll before has found it, at `before`, although it was fast. That `matters` on a straight line and for a
    /// motor that rotates; no other motor counts as fast. `brisk` tells the speed above which a motor is somewhere else
    /// in each poll.
    pub(super) fn stays(
        &mut self,
        known: &Known,
        before: i32,
        ahead: i32,
        matters: bool,
        brisk: impl FnOnce() -> i32,
    ) -> bool {
        // The speed, and one of the switches, may have been read many milliseconds ago.
        let is_brisk = if known.speed == 0 { self.brisk } else { known.speed.abs() > brisk() };
        self.brisk = matters && is_brisk;
        self.brisk && !self.holds() && ahead != 0 && known.position == before
    }

    /// Counts a poll, in which a stop switch holds the motor or does not.
    pub(super) const fn count(&mut self, held: bool) {
        self.polls = if held { self.polls.saturating_add(1) } else { 0 };
    }
}
