//! The stop switches of an axis, as its ramp generator sees them, and the latch that keeps the position of their edges.

use crate::motion::Error;
use crate::motion::profile::Profile;

/// The stop switches of an axis and their latch. States of switches are left and right: true is closed, after
/// inversion.
///
/// # Errors
/// A function fails where a chip does not take a datagram or does not answer one. Calling it once more is right in any
/// case.
pub trait StopSwitches {
    /// Reads the stop switches.
    fn switches(&mut self) -> Result<[bool; 2], Error>;

    /// The stop switches in this turn. The hardware may read them for all axes of the controller when the first one
    /// asks.
    fn turn_switches(&mut self) -> Result<[bool; 2], Error>;

    /// True while a closed stop switch acts on a motor that is to turn in the direction `ahead`, of which only the sign
    /// counts, by the last readings.
    fn meets_switch(&self, profile: &Profile<'_>, ahead: i32) -> bool;

    /// True while a stop switch keeps the motor from turning in the direction `ahead`. To be called while the last
    /// reading of the speed is 0, or the position `stays` although the motor was fast. In the second case the last
    /// reading of the switches may be older.
    fn is_held(&mut self, profile: &Profile<'_>, ahead: i32, stays: bool) -> Result<bool, Error>;

    /// Arms the latch: the position is to be kept at which the stop switch of
    /// [`Stops::latch`](crate::motion::Stops::latch) opens, which is closed now.
    fn latch(&mut self) -> Result<(), Error>;

    /// The position in microsteps that the latch has kept since it was armed; `None` if the switch has not opened
    /// since.
    fn latched(&mut self) -> Result<Option<i32>, Error>;
}
