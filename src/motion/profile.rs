//! How a motor is to move: what its parameters, the pace of a command and a reference search make of it together.

use super::switch::Stops;
use super::values::Values;

/// The motion profile of an axis. Speeds and accelerations are in the units of the product's parameter table, which are
/// those of its ramp generator: for a TMC429 internal units, 0..=2047.
#[derive(Clone, Copy, Debug)]
pub struct Profile<'a> {
    /// All parameters of the axis. The hardware takes those from here that only its kind has, for example divisors.
    pub values: &'a Values,
    /// The speed at which the motor goes to a position.
    pub speed: i32,
    /// The acceleration of the motor's ramps, up and down.
    pub acceleration: i32,
    /// How far from position zero, in microsteps, the motor runs over the stop switches: with 0 they act everywhere.
    pub tolerance: i32,
    /// The effect of the stop switches.
    pub stops: Stops,
}
