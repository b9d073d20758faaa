//! The dimension of velocities (208Ch), and what the motion controller makes of velocities and accelerations in it.
//!
//! The TMC429's internal velocity V is V * 16 MHz / 2^(16 + PULSE_DIV) microsteps per second. Its internal acceleration
//! A is A * (16 MHz)^2 / 2^(29 + PULSE_DIV + RAMP_DIV) microsteps per second squared (datasheet section 8.1.13 for
//! both). With 16 MHz = 15625 * 2^10 both are fractions of small numbers, so that all here is exact up to the one
//! rounding to the nearest internal unit.

use crate::canopen::entry::Entry;
use crate::canopen::object::Object;
use crate::canopen::values::Values;
use crate::motion::tmc429::ramp;
use crate::units::{INTERNAL_MAX, Internal};

/// The clock of the TMC429 in Hz.
const CLOCK: u64 = 16_000_000;
/// The odd part of the clock.
const ODD: u64 = CLOCK >> 10;
/// Largest velocity and acceleration of the TMC429, in internal units.
pub(crate) const INTERNAL: u32 = INTERNAL_MAX.unsigned_abs();
/// Largest divisor of the TMC429, as an exponent of two.
const DIVISOR_MAX: u8 = 13;

/// The dimension of velocities and accelerations, by the numbers of 208Ch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dimension {
    Internal,
    /// Revolutions per minute, and these per second.
    Rpm,
    /// Microsteps per second, and these per second.
    Pps,
}

impl Dimension {
    /// The dimension with this number of 208Ch.
    const fn numbered(number: u32) -> Self {
        match number {
            164 => Dimension::Rpm,
            181 => Dimension::Pps,
            _ => Dimension::Internal,
        }
    }
}

/// A number of one kind as a multiple of one of another: `factor` of the first are `base` of the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Ratio {
    factor: u64,
    base: u64,
}

impl Ratio {
    const ONE: Ratio = Ratio { factor: 1, base: 1 };

    /// Converts this number, to the nearest; what is too large becomes some large number. Where dividend and divisor
    /// have 32 bits, as those of velocities mostly have, a Cortex-M4 divides in one instruction.
    fn convert(self, number: u64) -> u64 {
        let dividend = number.saturating_mul(self.factor).saturating_add(self.base >> 1);
        match (u32::try_from(dividend), u32::try_from(self.base)) {
            (Ok(dividend), Ok(base)) => dividend.checked_div(base).unwrap_or_default().into(),
            _ => dividend.checked_div(self.base).unwrap_or_default(),
        }
    }

    /// True if the number is at most the largest internal velocity or acceleration, unrounded.
    const fn fits(self, number: u64) -> bool {
        number.saturating_mul(self.factor) <= self.base.saturating_mul(INTERNAL as u64)
    }

    /// The ratio of the numbers of the other way.
    const fn inverse(self) -> Self {
        Ratio { factor: self.base, base: self.factor }
    }
}

/// How velocities and accelerations in the dimension of 208Ch become internal ones, and with which divisors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Scale {
    dimension: Dimension,
    /// Number of microsteps in a turn of the motor.
    turn: u32,
    /// Internal velocities and accelerations for those of the dimension.
    velocity: Ratio,
    acceleration: Ratio,
    /// The internal velocity of 2087h and the internal acceleration of 2088h.
    fastest: Internal,
    steepest: Internal,
    ramp_div: u8,
    pulse_div: u8,
}

impl Scale {
    /// The scale of the defaults.
    pub(crate) const START: Scale = Scale {
        dimension: Dimension::Internal,
        turn: 200 << 8,
        velocity: Ratio::ONE,
        acceleration: Ratio::ONE,
        fastest: INTERNAL_MAX,
        steepest: INTERNAL_MAX,
        ramp_div: 7,
        pulse_div: 3,
    };

    /// The scale for these values of 2000h, 2001h, 2085h to 2088h and 208Ch. In internal units the divisors are 2085h
    /// and 2086h; otherwise they are the largest with which 2087h and 2088h can be reached, for the smallest steps.
    pub(crate) fn of(values: &Values) -> Self {
        let value = |object| values.of_object(object);
        let dimension = Dimension::numbered(value(Object::VelocityDimension));
        let turn =
            value(Object::FullStepResolution).saturating_mul(1_u32.unbounded_shl(value(Object::MicrostepResolution)));
        let (fastest, steepest) = (value(Object::MaximumVelocity).into(), value(Object::MaximumAcceleration).into());
        let pulse_div = match dimension {
            Dimension::Internal => value(Object::PulseDivisor) as u8,
            _ => {
                let fits = |divisor: &u8| velocity_ratio(dimension, turn, *divisor).fits(fastest);
                (0..=DIVISOR_MAX).rev().find(fits).unwrap_or(0)
            }
        };
        let ramp_div = match dimension {
            Dimension::Internal => value(Object::RampDivisor) as u8,
            _ => {
                let mut admitted = (0..=DIVISOR_MAX).filter(|divisor| admit_ramp(*divisor, pulse_div));
                let fits = |divisor: &u8| acceleration_ratio(dimension, turn, pulse_div, *divisor).fits(steepest);
                let least = admitted.next().unwrap_or(0);
                admitted.rev().find(fits).unwrap_or(least)
            }
        };
        let (ramp_div, pulse_div) = if admit_ramp(ramp_div, pulse_div) {
            (ramp_div, pulse_div)
        } else {
            // Neither is written so; an EEPROM may have it.
            let default = |object| Entry::of(object).row().default_number(0, 0) as u8;
            (default(Object::RampDivisor), default(Object::PulseDivisor))
        };
        let velocity = velocity_ratio(dimension, turn, pulse_div);
        let acceleration = acceleration_ratio(dimension, turn, pulse_div, ramp_div);
        Scale {
            dimension,
            turn,
            velocity,
            acceleration,
            fastest: limited(velocity.convert(fastest), INTERNAL_MAX),
            steepest: limited(acceleration.convert(steepest), INTERNAL_MAX).max(1),
            ramp_div,
            pulse_div,
        }
    }

    /// The same motor in the dimension with this number of 208Ch, for its largest values.
    pub(crate) const fn in_dimension(&self, number: u32) -> Self {
        Scale { dimension: Dimension::numbered(number), ..*self }
    }

    /// RAMP_DIV and PULSE_DIV.
    pub(crate) const fn divisors(&self) -> (u8, u8) {
        (self.ramp_div, self.pulse_div)
    }

    /// Number of microsteps in a turn of the motor.
    pub(crate) const fn turn(&self) -> u32 {
        self.turn
    }

    /// True if velocities depend on the number of microsteps in a turn.
    pub(crate) const fn is_of_turns(&self) -> bool {
        matches!(self.dimension, Dimension::Rpm)
    }

    /// True in internal units.
    pub(crate) const fn is_internal(&self) -> bool {
        matches!(self.dimension, Dimension::Internal)
    }

    /// The number of 208Eh.
    pub(crate) const fn acceleration_dimension(&self) -> u32 {
        match self.dimension {
            Dimension::Internal => 0,
            Dimension::Rpm => 177,
            Dimension::Pps => 179,
        }
    }

    /// The internal velocity nearest to this one. Those beyond 2087h work as that.
    pub(crate) fn velocity(&self, velocity: i64) -> Internal {
        let amount = limited(self.velocity.convert(velocity.unsigned_abs()), self.fastest);
        if velocity < 0 { amount.wrapping_neg() } else { amount }
    }

    /// The internal acceleration nearest to this one. Those beyond 2088h work as that; the least is 1, so that each
    /// motor can be stopped.
    pub(crate) fn acceleration(&self, acceleration: u32) -> Internal {
        limited(self.acceleration.convert(acceleration.into()), self.steepest).max(1)
    }

    /// The internal velocity nearest to a velocity from which on something acts (20A4h, 20A5h). As 0 means off, any
    /// other velocity is at least 1.
    pub(crate) fn threshold(&self, velocity: u32) -> Internal {
        let nearest = limited(self.velocity.convert(velocity.into()), INTERNAL_MAX);
        if velocity == 0 { 0 } else { nearest.max(1) }
    }

    /// The velocity nearest to this internal one.
    pub(crate) fn velocity_of(&self, internal: Internal) -> i32 {
        let amount = limited(self.velocity.inverse().convert(internal.unsigned_abs().into()), i32::MAX);
        if internal < 0 { amount.wrapping_neg() } else { amount }
    }

    /// The largest velocity that 2087h can have: that of internal velocity 2047 with PULSE_DIV 0.
    pub(crate) fn largest_velocity(&self) -> u32 {
        largest(velocity_ratio(self.dimension, self.turn, 0))
    }

    /// The largest acceleration that 2088h can have: that of internal acceleration 2047 with PULSE_DIV and RAMP_DIV 0.
    pub(crate) fn largest_acceleration(&self) -> u32 {
        largest(acceleration_ratio(self.dimension, self.turn, 0, 0))
    }
}

/// True if the motion controller can go to a position with these divisors.
pub(crate) fn admit_ramp(ramp_div: u8, pulse_div: u8) -> bool {
    let known = ramp_div <= DIVISOR_MAX && pulse_div <= DIVISOR_MAX;
    known && ramp::braking(INTERNAL_MAX, ramp_div, pulse_div, INTERNAL_MAX).is_some()
}

/// Internal velocities for those of a dimension, by the number of microsteps in a turn.
fn velocity_ratio(dimension: Dimension, turn: u32, pulse_div: u8) -> Ratio {
    shifted(dimension, turn, ODD, u32::from(pulse_div).saturating_add(16 - 10))
}

/// Internal accelerations for those of a dimension.
fn acceleration_ratio(dimension: Dimension, turn: u32, pulse_div: u8, ramp_div: u8) -> Ratio {
    let divisors = u32::from(pulse_div).saturating_add(ramp_div.into());
    shifted(dimension, turn, ODD.saturating_mul(ODD), divisors.saturating_add(29 - 2 * 10))
}

/// The ratio 2^`shift` / `odd` for numbers in microsteps, in a dimension. No factor reaches 2^60: a turn has less than
/// 2^24 microsteps, and the shift is at most 35.
fn shifted(dimension: Dimension, turn: u32, odd: u64, shift: u32) -> Ratio {
    match dimension {
        Dimension::Internal => Ratio::ONE,
        Dimension::Rpm => Ratio { factor: u64::from(turn).unbounded_shl(shift), base: odd.saturating_mul(60) },
        Dimension::Pps => Ratio { factor: 1_u64.unbounded_shl(shift), base: odd },
    }
}

/// The largest number that this ratio makes not more than the largest internal one.
fn largest(ratio: Ratio) -> u32 {
    let most = ratio.base.saturating_mul(INTERNAL.into()).checked_div(ratio.factor).unwrap_or_default();
    u32::try_from(most).unwrap_or(u32::MAX)
}

/// A number, or the limit if that is less.
fn limited(number: u64, limit: i32) -> i32 {
    i32::try_from(number).unwrap_or(i32::MAX).min(limit)
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing, clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Numbers that vary widely in their magnitude, the same in each run.
    struct Numbers(u64);

    impl Numbers {
        fn below(&mut self, end: u64) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) % end
        }

        /// A number from 1 to `most`, of any length.
        fn up_to(&mut self, most: u32) -> u32 {
            let length = self.below(u64::from(most.ilog2()) + 1) + 1;
            (self.below(1 << length) as u32).clamp(1, most)
        }
    }

    fn values(objects: &[(Object, u32)]) -> Values {
        let mut values = Values::of(1);
        for (object, value) in objects {
            values.set(Entry::of(*object), *value);
        }
        values
    }

    /// The scale in a dimension, with these largest values, cut off at the largest possible.
    fn scale(dimension: u32, full_steps: u32, resolution: u32, velocity: u32, acceleration: u32) -> (Scale, u32, u32) {
        let mut values = values(&[
            (Object::VelocityDimension, dimension),
            (Object::FullStepResolution, full_steps),
            (Object::MicrostepResolution, resolution),
        ]);
        let all = Scale::of(&values);
        let (velocity, acceleration) =
            (velocity.min(all.largest_velocity()), acceleration.min(all.largest_acceleration()));
        values.set(Entry::of(Object::MaximumVelocity), velocity);
        values.set(Entry::of(Object::MaximumAcceleration), acceleration);
        (Scale::of(&values), velocity, acceleration)
    }

    /// Microsteps in a unit of velocity, per second.
    fn microsteps(dimension: u32, full_steps: u32, resolution: u32) -> f64 {
        if dimension == 181 { 1.0 } else { f64::from(full_steps << resolution) / 60.0 }
    }

    /// The datasheet's formulas: internal units in a microstep per second, and per second squared.
    fn internal(ramp_div: u8, pulse_div: u8) -> (f64, f64) {
        let [ramp_div, pulse_div] = [ramp_div, pulse_div].map(i32::from);
        (2_f64.powi(16 + pulse_div) / 16e6, 2_f64.powi(29 + ramp_div + pulse_div) / (16e6 * 16e6))
    }

    /// Half an internal unit, and what a floating-point number of this size may be wrong by.
    const HALF: f64 = 0.5 + 1e-9;

    /// Motors: full steps in a turn, and microsteps as a power of two.
    const MOTORS: [(u32, u32); 6] = [(200, 8), (200, 0), (400, 4), (1, 0), (65_535, 8), (48, 6)];

    #[test]
    fn the_divisors_are_the_largest_that_fit() {
        let mut numbers = Numbers(1);
        let (mut pulse_divs, mut ramp_divs) = ([0; 14], [0; 14]);
        for dimension in [164, 181] {
            for (full_steps, resolution) in MOTORS {
                for _ in 0..2000 {
                    let most = [numbers.up_to(u32::MAX), numbers.up_to(u32::MAX)];
                    let (scale, velocity, acceleration) = scale(dimension, full_steps, resolution, most[0], most[1]);
                    let unit = microsteps(dimension, full_steps, resolution);
                    let (velocity, acceleration) = (f64::from(velocity) * unit, f64::from(acceleration) * unit);
                    let (ramp_div, pulse_div) = scale.divisors();
                    let fits = |divisor: &u8| velocity * internal(0, *divisor).0 <= 2047.0 * (1.0 + 1e-12);
                    let largest = (0..=13).rev().find(fits).unwrap();
                    assert_eq!(pulse_div, largest, "{scale:?}");
                    let admitted = |divisor: &u8| ramp::braking(2047, *divisor, pulse_div, 2047).is_some();
                    let fits = |divisor: &u8| acceleration * internal(*divisor, pulse_div).1 <= 2047.0 * (1.0 + 1e-12);
                    let largest = (0..=13).rev().filter(admitted).find(fits);
                    assert_eq!(ramp_div, largest.unwrap_or(if pulse_div == 13 { 1 } else { 0 }), "{scale:?}");
                    pulse_divs[usize::from(pulse_div)] += 1;
                    ramp_divs[usize::from(ramp_div)] += 1;
                }
            }
        }
        assert!(pulse_divs.iter().chain(&ramp_divs).all(|count| *count > 50), "{pulse_divs:?} {ramp_divs:?}");
    }

    #[test]
    fn velocities_and_accelerations_are_right_to_half_an_internal_unit() {
        let mut numbers = Numbers(2);
        for dimension in [164, 181] {
            for (full_steps, resolution) in MOTORS {
                for _ in 0..200 {
                    let most = [numbers.up_to(u32::MAX), numbers.up_to(u32::MAX)];
                    let (scale, fastest, steepest) = scale(dimension, full_steps, resolution, most[0], most[1]);
                    let (ramp_div, pulse_div) = scale.divisors();
                    let unit = microsteps(dimension, full_steps, resolution);
                    let (per_velocity, per_acceleration) = internal(ramp_div, pulse_div);
                    let (per_velocity, per_acceleration) = (unit * per_velocity, unit * per_acceleration);
                    let place = format!("{scale:?}");
                    for _ in 0..100 {
                        let velocity = numbers.up_to(fastest);
                        let (right, left) = (scale.velocity(velocity.into()), scale.velocity(-i64::from(velocity)));
                        let exact = f64::from(velocity) * per_velocity;
                        assert!((f64::from(right) - exact).abs() <= HALF, "{velocity}: {right}, {exact}: {place}");
                        assert_eq!(left, -right, "{velocity}: {place}");
                        let threshold = scale.threshold(velocity);
                        assert_eq!(threshold, right.max(1), "{velocity}: {place}");
                        let acceleration = numbers.up_to(steepest);
                        let (found, exact) =
                            (scale.acceleration(acceleration), f64::from(acceleration) * per_acceleration);
                        let exact = exact.clamp(1.0, 2047.0);
                        assert!((f64::from(found) - exact).abs() <= HALF, "{acceleration}: {found}, {exact}: {place}");
                        let speed = numbers.below(2048) as i32;
                        let exact = f64::from(speed) / per_velocity;
                        let shown = scale.velocity_of(speed);
                        assert!((f64::from(shown) - exact).abs() <= HALF, "{speed}: {shown}, {exact}: {place}");
                        assert_eq!(scale.velocity_of(-speed), -shown);
                    }
                    assert_eq!((scale.velocity(0), scale.threshold(0), scale.velocity_of(0)), (0, 0, 0));
                    assert_eq!(scale.acceleration(0), 1);
                    for beyond in [i64::from(fastest), i64::from(fastest) * 2, u32::MAX.into(), i64::MAX] {
                        assert_eq!(scale.velocity(beyond), scale.velocity(fastest.into()), "{beyond}: {place}");
                        assert_eq!(scale.velocity(-beyond), -scale.velocity(fastest.into()), "{beyond}: {place}");
                    }
                    assert_eq!(scale.velocity(i64::MIN), -scale.velocity(fastest.into()), "{place}");
                    assert_eq!(scale.acceleration(u32::MAX), scale.acceleration(steepest), "{place}");
                    assert!((1..=2047).contains(&scale.velocity(fastest.into())), "{place}");
                    assert!((1..=2047).contains(&scale.threshold(u32::MAX)), "{place}");
                    assert!((1..=2047).contains(&scale.acceleration(u32::MAX)), "{place}");
                }
            }
        }
    }

    #[test]
    fn internal_units_stay_as_they_are() {
        let scale = Scale::of(&values(&[(Object::RampDivisor, 5), (Object::PulseDivisor, 2)]));
        assert!(scale.is_internal());
        assert_eq!(scale.divisors(), (5, 2));
        for velocity in [0, 1, 1000, 2047] {
            assert_eq!((scale.velocity(velocity.into()), scale.velocity((-velocity).into())), (velocity, -velocity));
            assert_eq!((scale.velocity_of(velocity), scale.velocity_of(-velocity)), (velocity, -velocity));
            assert_eq!(scale.acceleration(velocity.unsigned_abs()), velocity.max(1));
            assert_eq!(scale.threshold(velocity.unsigned_abs()), velocity);
        }
        for beyond in [2048, 51_200, u32::MAX] {
            assert_eq!((scale.velocity(beyond.into()), scale.velocity(-i64::from(beyond))), (2047, -2047));
            assert_eq!((scale.acceleration(beyond), scale.threshold(beyond)), (2047, 2047));
        }
        assert_eq!(Scale::of(&Values::of(1)), Scale::START);
        assert_eq!((scale.largest_velocity(), scale.largest_acceleration()), (2047, 2047));
    }

    /// The divisors count as their defaults where the motion controller could go to no position with them.
    #[test]
    fn divisors_that_admit_no_ramp() {
        for (ramp_div, pulse_div) in [(13, 0), (0, 13), (255, 255), (14, 3)] {
            let objects = [(Object::RampDivisor, ramp_div), (Object::PulseDivisor, pulse_div)];
            assert_eq!(Scale::of(&values(&objects)).divisors(), (7, 3));
        }
    }

    /// A motor of 200 full steps with 256 microsteps: 2047 * 16 MHz / 2^16 microsteps per second, and 60 / 51200 of
    /// that in a minute.
    #[test]
    fn the_largest_values_are_those_of_the_datasheet() {
        let of = |dimension| scale(dimension, 200, 8, u32::MAX, u32::MAX);
        assert_eq!((of(181).1, of(164).1), (499_755, 585));
        let acceleration = 2047.0 * 16e6 * 16e6 / f64::from(1_u32 << 29);
        assert_eq!(of(181).2, acceleration as u32);
        assert_eq!(of(164).2, (acceleration * 60.0 / 51_200.0) as u32);
        assert_eq!((of(181).0.divisors(), of(164).0.divisors()), ((0, 0), (0, 0)));
        assert_eq!([0, 164, 181].map(|dimension| of(dimension).0.acceleration_dimension()), [0, 177, 179]);
    }

    /// No stored value makes a panic.
    #[test]
    fn any_values() {
        let mut numbers = Numbers(3);
        for _ in 0..20_000 {
            let mut any = |object| (object, if numbers.below(4) == 0 { u32::MAX } else { numbers.up_to(u32::MAX) });
            let mut objects = [
                Object::FullStepResolution,
                Object::MicrostepResolution,
                Object::MaximumVelocity,
                Object::MaximumAcceleration,
                Object::RampDivisor,
                Object::PulseDivisor,
                Object::VelocityDimension,
            ]
            .map(&mut any);
            objects[6].1 = [0, 164, 181][numbers.below(3) as usize];
            let scale = Scale::of(&values(&objects));
            for number in [0, 1, numbers.up_to(u32::MAX), u32::MAX] {
                assert!((-2047..=2047).contains(&scale.velocity(i64::from(number as i32))));
                assert!((1..=2047).contains(&scale.acceleration(number)));
                assert!((0..=2047).contains(&scale.threshold(number)));
                scale.velocity_of(number as i32);
            }
        }
    }
}
