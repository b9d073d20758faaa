//! The ramps that a kind of ramp generator makes, without the chip: what shapes them besides a top speed and one
//! acceleration, and how fast they really are. Speeds and accelerations are in the units of the product's parameter
//! table.

use core::fmt;

use crate::motion::ratio::Ratio;
use crate::motion::slope::Slopes;
use crate::motion::values::Values;
use crate::param::AxisParameter;

/// The shape of the ramps of a ramp generator besides a top speed and one acceleration. Axes on a straight line have
/// the same in the ratio of their ways.
pub trait Shape: Copy + fmt::Debug {
    /// The parameters that determine the units of speeds and accelerations.
    const UNITS: &'static [AxisParameter];

    /// The parameters of positioning ramps, in those units.
    const RAMPS: &'static [AxisParameter];

    /// The shape that the parameters of an axis give its ramps.
    fn of(values: &Values) -> Self;

    /// True if the ramp generator can go to a position with these parameters.
    fn accepts(values: &Values) -> bool;

    /// Reduces what is so much that an axis with the `ratio` of the way does not exceed its `own`.
    fn limit(&mut self, ratio: Ratio, own: &Self);

    /// The shape in the ratio of the ways, rounded up, and at most its `own`.
    fn scaled(&self, ratio: Ratio, own: &Self) -> Self;

    /// The slopes that the motor really has for an acceleration of `wanted` on its way to a position, with ramps of
    /// this shape, at a speed of up to `speed`.
    fn slopes(&self, values: &Values, wanted: i32, speed: i32) -> Slopes;

    /// By how much, in 1/256 microstep, two motors seem to lag because their positions are not read at the same time,
    /// at a speed.
    fn skew(speed: i32) -> i32;

    /// The difference of speed, in 1/256 of its unit, by which a motor makes up for a lag of `way`, in 1/256 microstep,
    /// within some 16 ms. `way` is at most 2^16 to either side.
    fn correction(values: &Values, way: i32) -> i32;
}
