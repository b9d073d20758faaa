//! Hardware that tells how long its readings stay as they are. Whoever simulates a module asks for this, so as to leave
//! polls out; the images do not.

use super::hardware::Hardware;

/// Hardware that tells how long its readings stay as they are, but for the position and the load of a motor that turns
/// on at its speed.
pub trait Foreseeable: Hardware {
    /// Number of readings in a rotation, in which each comes at least once. The next rotation has the same datagrams.
    const ROTATION: u8;

    /// Number of readings after which nothing that is known of a motor that turns is older than they are.
    const FRESH: u8;

    /// The number of microsteps that a motor which turns on may still make, from its last known position; 0 for a motor
    /// that rests. Before these are made, [`follow`](super::RampGenerator::follow) and
    /// [`refresh`](super::RampGenerator::refresh) only read, and the axis does not act upon its position. `None` if
    /// they may do more than to read now.
    fn room(&self, controller: &Self::Controller) -> Option<u32>;
}
