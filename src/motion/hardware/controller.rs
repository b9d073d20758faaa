//! The motion controller, which several axes have in common.

use crate::motion::Error;

/// A motion controller: the bus to it, and what is known of its registers. One controller moves several axes.
///
/// # Errors
/// A function fails where the chip does not take a datagram or does not answer one. Calling it once more is right in
/// any case.
pub trait MotionController {
    /// How many axes one motion controller moves: axis n of a module belongs to controller n / `AXES`.
    const AXES: usize;

    /// Sets the motion controller up, with its motors at a stand. Afterwards each of its axes is given a
    /// [position](super::RampGenerator::set_position) and a [goal](super::RampGenerator::go).
    ///
    /// # Errors
    /// The controller does not answer as one of its kind does.
    fn start(&mut self) -> Result<(), Error>;

    /// Stops all motors of the motion controller at once, whatever they were doing: the controller may be running since
    /// before the firmware started. Its axes are not told: each is given a
    /// [position](super::RampGenerator::set_position) or is [stopped](super::RampGenerator::stop) before it moves
    /// again.
    ///
    /// # Errors
    /// Some datagrams did not get through; the others were sent all the same.
    fn stop_all(&mut self) -> Result<(), Error>;

    /// True if the motion controller answers. A controller that has not answered before is asked again by this.
    fn is_there(&mut self) -> bool;

    /// Inverts the inputs of the stop switches, and the direction outputs of the motors, of all axes of the motion
    /// controller; each where its argument is true.
    fn invert(&mut self, switches: bool, direction: bool) -> Result<(), Error>;

    /// A turn begins, the millisecond in which each axis is polled once.
    fn begin_turn(&mut self);

    /// True if the [reading](super::RampGenerator::refresh) of this number is one of speed or switches.
    fn is_of_motion(reading: u8) -> bool;
}
