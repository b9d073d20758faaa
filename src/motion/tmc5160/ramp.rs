//! The registers of a TMC5160 that make the ramps of a move to a position: six points, with two accelerations and two
//! decelerations (TMC5160 datasheet section 12.2).

use super::unit::{SpeedUnit, TOP_SPEED};
use crate::chip::tmc5160::Register;
use crate::motion::hardware;
use crate::motion::profile::Profile;
use crate::motion::ratio::Ratio;
use crate::motion::slope::{Slope, Slopes};
use crate::motion::values::Values;
use crate::param::AxisParameter as P;

/// The six points of a ramp but for its top speed and its acceleration AMAX, in the unit of the axis' parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// VSTART, VSTOP and V1.
    pub(super) speeds: [i32; 3],
    /// A1, DMAX and D1.
    pub(super) accelerations: [i32; 3],
}

impl Shape {
    /// The shape that the parameters of an axis give its ramps.
    pub(super) fn of(values: &Values) -> Self {
        Shape {
            speeds: [P::StartVelocity, P::StopVelocity, P::FirstVelocity].map(|speed| values.get(speed)),
            accelerations: [P::FirstAcceleration, P::MaximumDeceleration, P::LastDeceleration]
                .map(|acceleration| values.get(acceleration)),
        }
    }

    /// The shape where V1 is not 0: with 0, A1 and D1 have no effect, as if all of the ramp were below V1 and AMAX and
    /// DMAX held there.
    pub(super) fn in_two_parts(self, values: &Values) -> Self {
        let Shape { speeds: [start, stop, first], accelerations: [_, d_max, _] } = self;
        if first != 0 {
            return self;
        }
        let a_max = values.get(P::MaximumAcceleration);
        Shape { speeds: [start, stop, i32::MAX], accelerations: [a_max, d_max, d_max] }
    }
}

impl hardware::Shape for Shape {
    const UNITS: &'static [P] = &[P::UnitMode];

    const RAMPS: &'static [P] = &[
        P::MaximumSpeed,
        P::MaximumAcceleration,
        P::StartVelocity,
        P::FirstAcceleration,
        P::FirstVelocity,
        P::MaximumDeceleration,
        P::LastDeceleration,
        P::StopVelocity,
    ];

    fn of(values: &Values) -> Self {
        Self::of(values).in_two_parts(values)
    }

    /// The chip takes all values that the ranges of the parameters allow.
    fn accepts(_: &Values) -> bool {
        true
    }

    fn limit(&mut self, ratio: Ratio, own: &Self) {
        for (speed, own) in self.speeds.iter_mut().zip(own.speeds) {
            *speed = ratio.limit(own, *speed);
        }
        for (acceleration, own) in self.accelerations.iter_mut().zip(own.accelerations) {
            *acceleration = ratio.limit(own.max(1), *acceleration);
        }
    }

    fn scaled(&self, ratio: Ratio, own: &Self) -> Self {
        let [mut speeds, mut accelerations] = [self.speeds, self.accelerations];
        for (speed, own) in speeds.iter_mut().zip(own.speeds) {
            *speed = ratio.up(*speed, own);
        }
        for (acceleration, own) in accelerations.iter_mut().zip(own.accelerations) {
            *acceleration = ratio.up(*acceleration, own);
        }
        Shape { speeds, accelerations }
    }

    fn slopes(&self, values: &Values, wanted: i32, _: i32) -> Slopes {
        let unit = SpeedUnit::of(values);
        let Shape { speeds: [start, stop, first], accelerations: [a1, d_max, d1] } = *self;
        let bent = |begin: i32, below: i32, above: i32| {
            let [below, above] = [below, above].map(|acceleration| unit.growth(unit.acceleration(acceleration)));
            Slope::bent(begin.unsigned_abs(), first.unsigned_abs(), below, above)
        };
        let acceleration = unit.of_acceleration(unit.acceleration(wanted));
        Slopes { acceleration, up: bent(start, a1, wanted), down: bent(stop, d1, d_max) }
    }

    /// The positions of two chips are read within some 60 us: at 1 pps the motor makes 1/65 of 1/256 microstep
    /// meanwhile.
    fn skew(speed: i32) -> i32 {
        speed >> 6
    }

    /// A lag of a microstep is made up for in 16.4 ms by 61 pps.
    fn correction(_: &Values, way: i32) -> i32 {
        way.saturating_mul(61)
    }
}

/// The registers of a positioning ramp, in the order in which they are written: a new top speed comes last.
///
/// The chip must not get a VSTOP of 0, a deceleration of 0, or a VSTOP below VSTART; the motor may then never arrive.
/// VSTART is at most VMAX, so that with a top speed of 0 the motor stays where it is.
pub(super) fn words(profile: &Profile<'_>, shape: Shape) -> [(Register, u32); 9] {
    let Profile { values, speed, acceleration, .. } = *profile;
    let Shape { speeds: [start, stop, first], accelerations: [a1, d_max, d1] } = shape;
    let unit = SpeedUnit::of(values);
    let top = unit.speed(speed).min(TOP_SPEED);
    let start = unit.speed(start).clamp(1, (1 << 18) - 1).min(top);
    let stop = unit.speed(stop).min((1 << 18) - 1).max(start).max(1);
    [
        (Register::VStart, start),
        (Register::A1, unit.acceleration(a1)),
        (Register::V1, unit.speed(first).min((1 << 20) - 1)),
        (Register::AMax, unit.acceleration(acceleration)),
        (Register::DMax, unit.acceleration(d_max)),
        (Register::D1, unit.acceleration(d1)),
        (Register::VStop, stop),
        (Register::TZeroWait, values.get(P::RampWaitTime) as u32),
        (Register::VMax, top),
    ]
}
