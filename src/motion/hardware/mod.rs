//! The hardware of an axis: a ramp generator, which makes step pulses, and a driver, which makes coil currents of them.
//! The two may be two chips or one.
//!
//! An axis reaches its chips by these traits alone and so knows none of them. A chip may be shared. What the axes of
//! one [`MotionController`] have in common is not the axis' own, so a value that [binds](Hardware::bind) the two is
//! lent for a call. That value is [`RampGenerator`], [`Driver`] and [`StopSwitches`]. What a chip demands - how wide
//! its positions are, in which order its registers are written - is known in one directory for each kind of hardware.

mod controller;
mod driver;
mod generator;
mod known;
mod readings;
mod shape;
mod switches;

pub use controller::MotionController;
pub use driver::Driver;
pub use generator::{Followed, Goal, RampGenerator};
pub use known::{Known, RampMode};
pub use readings::Readings;
pub use shape::Shape;
pub use switches::StopSwitches;

use crate::param::AxisParameter;

/// The hardware that one axis has to itself.
pub trait Hardware {
    /// The motion controller, which several axes have in common.
    type Controller: MotionController;

    /// The shape of the ramps besides a top speed and an acceleration.
    type Shape: Shape;

    /// The axis' own hardware with its motion controller, and so with the way to its chips.
    type Bound<'a>: RampGenerator<Shape = Self::Shape> + Driver + StopSwitches
    where
        Self: 'a;

    /// Of the parameters on which the excitation of the motor depends those that [`Driver::drive`] also takes from the
    /// values themselves: so it is called when they are written.
    const DRIVEN: &'static [AxisParameter];

    /// Joins the axis' own hardware with its motion controller.
    fn bind<'a>(&'a mut self, controller: &'a mut Self::Controller) -> Self::Bound<'a>;

    /// The state that is known without a datagram.
    fn known(&self) -> &Known;

    /// The last readings.
    fn readings(&self, controller: &Self::Controller) -> Readings;

    /// The state that is known, for the goal in it to be put back after a command that was refused. The chips are told
    /// so by [`RampGenerator::go`].
    fn known_mut(&mut self) -> &mut Known;
}
