//! The ramp generator of an axis, which makes step pulses: goals, positions and speeds.

use crate::motion::Error;
use crate::motion::profile::Profile;
use crate::motion::values::Values;
use crate::param::AxisParameter;

/// The goal of a motor: to turn at a speed, or to go to a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// The motor shall turn at this speed, in the unit of the profile; right if positive.
    Speed(i32),
    /// The motor shall go to a position.
    Position {
        /// The position in microsteps. The motor goes there the shorter way round the 32 bits.
        target: i32,
        /// With an exponential approach, where the ramp generator has one; else with a trapezoidal ramp.
        soft: bool,
    },
}

/// The findings of [`RampGenerator::follow`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// The motor stands where it is to stand.
    pub rests: bool,
    /// The reading that was wanted, where it has not been taken yet.
    pub left: Option<u8>,
}

/// The ramp generator of an axis. Positions are in microsteps, speeds and accelerations in the units of [`Profile`].
///
/// # Errors
/// A function fails where a chip does not take a datagram or does not answer one. Then what it was to do is done in
/// part or not at all, and calling it once more is right in any case.
pub trait RampGenerator {
    /// The shape of the ramps besides a top speed and an acceleration.
    type Shape;

    /// Gives the motor a new goal, whatever it was doing; also while it moves.
    fn go(&mut self, goal: Goal, profile: &Profile<'_>) -> Result<(), Error>;

    /// Makes all ready for a positioning move but the datagram that sets the motor going. [`go`](Self::go) to the same
    /// goal with the same profile sends this datagram then, so several motors can be started at once. A motor that
    /// moves may go on with the new profile.
    fn prepare(&mut self, target: i32, profile: &Profile<'_>) -> Result<(), Error>;

    /// The motor goes on to its present goal, a position, with a profile of another speed or acceleration. Only so many
    /// datagrams are sent as one piece of a turn has time for. True if there were any: then this is to be called again.
    fn ease(&mut self, profile: &Profile<'_>) -> Result<bool, Error>;

    /// The motor goes on to its present goal with another profile.
    fn retune(&mut self, profile: &Profile<'_>) -> Result<(), Error>;

    /// Gives the ramps of the motor, from its next goal on, another shape than that of its parameters; `None` gives
    /// them that again.
    fn reshape(&mut self, shape: Option<Self::Shape>);

    /// Stops the motor at once, without a ramp. Its goal is then to turn at speed 0.
    fn stop(&mut self, profile: &Profile<'_>) -> Result<(), Error>;

    /// Makes `position` both the actual position and the target. Before this call the motor is `standing`, or turns at
    /// a speed. While it turns, the position of the chip may be this one or the former one if the function fails.
    fn set_position(&mut self, position: i32, standing: bool) -> Result<(), Error>;

    /// Follows the motor: reads the actual position of one that does not stand. `reading` is the number of the reading
    /// that is wanted as well, if there is one. This comes once in a millisecond.
    fn follow(&mut self, reading: Option<u8>) -> Result<Followed, Error>;

    /// Takes one of the other readings, in rotation; `reading` is its number, wrapping at 256. This comes once in a
    /// millisecond, where [`follow`](Self::follow) has left it; the axes of a motion controller take turns in it.
    fn refresh(&mut self, reading: u8) -> Result<(), Error>;

    /// Reads the actual position.
    fn position(&mut self) -> Result<i32, Error>;

    /// Reads the actual speed, right if positive.
    fn speed(&mut self) -> Result<i32, Error>;

    /// Reads the speed to which the motor is accelerating or braking: the commanded one, or, on the way to a position,
    /// the ramp generator's own.
    fn target_speed(&mut self) -> Result<i32, Error>;

    /// Reads a parameter that is known to this kind of hardware alone, in its unit in the product's table.
    ///
    /// # Errors
    /// [`Error::NotNow`] if this kind of hardware does not have the parameter.
    fn reading(&mut self, values: &Values, parameter: AxisParameter) -> Result<i32, Error>;

    /// Makes `position` that of an encoder whose counter is in the hardware, in the unit of parameter 209; without such
    /// a counter this does nothing.
    fn set_encoder(&mut self, position: i32) -> Result<(), Error> {
        let _ = position;
        Ok(())
    }
}
