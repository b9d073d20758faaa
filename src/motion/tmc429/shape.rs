//! The ramps of a TMC429, which are trapezoids of one acceleration.

use super::ramp;
use super::settings::divisors;
use crate::motion::hardware::Shape;
use crate::motion::ratio::Ratio;
use crate::motion::slope::{Slope, Slopes};
use crate::motion::values::Values;
use crate::param::AxisParameter as P;
use crate::units::INTERNAL_MAX;

/// A trapezoidal ramp, which has nothing besides a top speed and one acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trapezoid;

impl Shape for Trapezoid {
    const UNITS: &'static [P] = &[P::RampDivisor, P::PulseDivisor];

    const RAMPS: &'static [P] = &[P::MaximumSpeed, P::MaximumAcceleration];

    fn of(_: &Values) -> Self {
        Trapezoid
    }

    fn limit(&mut self, _: Ratio, _: &Self) {}

    fn scaled(&self, _: Ratio, _: &Self) -> Self {
        Trapezoid
    }

    /// False for the pairs of RAMP_DIV and PULSE_DIV that admit no positioning ramp, whatever its acceleration.
    fn accepts(values: &Values) -> bool {
        let (ramp_div, pulse_div) = divisors(values);
        ramp::braking(INTERNAL_MAX, ramp_div, pulse_div, INTERNAL_MAX).is_some()
    }

    /// From rest, or to it, with an acceleration of A, the square of the speed is 2048 p = 16 A 2^(PULSE_DIV -
    /// RAMP_DIV) for each microstep (datasheet section 8.1.10). Of p the chip has PMUL / 2^(3 + PDIV).
    fn slopes(&self, values: &Values, wanted: i32, speed: i32) -> Slopes {
        let (ramp_div, pulse_div) = divisors(values);
        let (acceleration, square) = match ramp::braking(wanted, ramp_div, pulse_div, speed) {
            Some(b) => (b.acceleration, u32::from(b.pmul) << 16 >> b.pdiv),
            None => (wanted, 0),
        };
        Slopes { acceleration, up: Slope::straight(square), down: Slope::straight(square) }
    }

    /// The motors of a TMC429 are so slow that they make less than a microstep in that time.
    fn skew(_: i32) -> i32 {
        0
    }

    /// The unit of speed is 16 MHz / (2^PULSE_DIV * 2048 * 32): 4 / 2^PULSE_DIV of it are a microstep in 16.4 ms.
    fn correction(values: &Values, way: i32) -> i32 {
        way << divisors(values).1 >> 2
    }
}
