//! How far a jog may go on: a held key is fuel for a short time, and nothing else keeps the motor moving.
//!
//! Each key that arrives gives the motor a target that is a certain time of travel ([`fuel`]), and the way to a stop,
//! ahead of where it is. Without another key it comes to rest there by itself, whatever has become of the key, the
//! terminal, this program and the cable.

use std::time::Duration;

use tmcm::param::AxisParameter;

use crate::calc::{Live, Settings};
use crate::conversation::{Conversation, Error};
use crate::product::{axis_number, speed_unit, symbol};

/// How long the motor goes on at least after a key, before it slows down. A held key comes again some 30 times a
/// second; over a slow connection the gaps are longer.
const FUEL: Duration = Duration::from_millis(140);
/// Longest time from the speed of a jog to a stop.
pub(super) const BRAKING: Duration = Duration::from_millis(90);
/// Longest time from the release of a key to a stop.
const RELEASE: Duration = Duration::from_millis(300);
/// Longest round trip of a request and its reply with which [`fuel`] is as long as it has to be. Six of them are no
/// more than `RELEASE` without `BRAKING` and 2.5 of them.
pub(super) const LONGEST_ROUND: Duration = Duration::from_micros((300_000 - 90_000) * 2 / 17);

/// How long the motor goes on after a key that was read, over a link whose round trip takes so long.
///
/// A key takes three round trips: for the speed, for the position, and for the target. The position is read half a
/// round trip before its reply is here, and the module has the target half a round trip before the reply. The key may
/// have waited for those of the key before it. So the motor slows down half a round trip before this time is over, and
/// the next target comes 5.5 round trips after the key. With 6 the motor does not stutter. The motor stands 3 - 0.5
/// round trips and `BRAKING` after this time.
pub(super) fn fuel(round: Duration) -> Duration {
    let most = (RELEASE - BRAKING).saturating_sub(round * 5 / 2);
    FUEL.max(round * 6).min(most)
}

/// The ramp of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ramp {
    /// Above 0, in microsteps per second, per second.
    acceleration: f64,
    /// Above 0, in microsteps per second, per second.
    deceleration: f64,
}

impl Ramp {
    /// How far a motor goes that has `speed` now, wants `wanted`, and begins to stop after `time` in seconds; both
    /// speeds in microsteps per second, negative to the left. A motor that goes the other way stops first.
    fn way(self, speed: f64, wanted: f64, time: f64) -> f64 {
        let direction = wanted.signum();
        let (mut speed, wanted) = (speed * direction, wanted.abs());
        let (mut way, mut left) = (0.0, time);
        if speed < 0.0 {
            way -= speed * speed / (2.0 * self.deceleration);
            left = (left + speed / self.deceleration).max(0.0);
            speed = 0.0;
        }
        let rate = if speed < wanted { self.acceleration } else { -self.deceleration };
        let changing = ((wanted - speed) / rate).min(left);
        way += changing * (speed + rate * changing / 2.0);
        speed += rate * changing;
        way += (left - changing) * speed;
        direction * (way + speed * speed / (2.0 * self.deceleration))
    }
}

/// An axis as a jog moves it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axle {
    /// The number of the axis.
    pub(super) axis: u8,
    /// The speed of the jog, in the module's unit.
    pub(super) speed: i32,
    /// The speed that was asked for; `speed` is less if stopping from there would take too long.
    pub(super) wanted: i32,
    /// The speed of positioning that the axis had before.
    pub(super) before: i32,
    /// The unit of speeds, in words.
    pub(super) unit: &'static str,
    /// The size of one of that unit in microsteps per second.
    factor: f64,
    ramp: Ramp,
}

impl Axle {
    /// Asks the module for the ramp of an axis. Without `wanted` the jog has the speed of positioning.
    pub(super) fn read(module: &mut Conversation, axis: u8, wanted: Option<i32>) -> Result<Self, Error> {
        let product = module.product()?;
        // How many steps a turn of the motor has makes no difference to microsteps per second.
        let settings = Settings::read(module, axis, 1)?;
        let unit = product.map_or("", |product| symbol(speed_unit(product), settings.in_chip));
        let before = module.axis(axis, AxisParameter::MaximumSpeed)?;
        let wanted = wanted.unwrap_or(before);
        let has = |parameter| axis_number(product, parameter).is_some();
        let mut read = |parameter| module.axis(axis, parameter).map(f64::from);
        let live = Live::new(product.unwrap_or_default(), settings);
        let (speeds, accelerations) = (live.speed_in_pulses(1), live.acceleration_in_pulses(1));
        let ramp = |acceleration: f64, deceleration: f64| Ramp {
            acceleration: acceleration * accelerations,
            deceleration: deceleration * accelerations,
        };
        let upper = read(AxisParameter::MaximumAcceleration)?;
        if !has(AxisParameter::MaximumDeceleration) {
            return Ok(Self::limited(axis, wanted, before, unit, speeds, |_| ramp(upper, upper)));
        }
        let upper = ramp(upper, read(AxisParameter::MaximumDeceleration)?);
        let first = read(AxisParameter::FirstVelocity)?;
        let lower = ramp(read(AxisParameter::FirstAcceleration)?, read(AxisParameter::LastDeceleration)?);
        // Above the first velocity the smaller rates are taken for the whole of the way.
        let both = Ramp {
            acceleration: upper.acceleration.min(lower.acceleration),
            deceleration: upper.deceleration.min(lower.deceleration),
        };
        let at = move |speed: f64| match first {
            0.0 => upper,
            first if speed <= first => lower,
            _ => both,
        };
        Ok(Self::limited(axis, wanted, before, unit, speeds, at))
    }

    /// The axis with a speed from which it stops in time; `ramp` gives the ramp for a speed in its own unit.
    fn limited(
        axis: u8,
        wanted: i32,
        before: i32,
        unit: &'static str,
        factor: f64,
        ramp: impl Fn(f64) -> Ramp,
    ) -> Self {
        let stops_in_time = |speed: i32| {
            let speed = f64::from(speed);
            speed * factor <= ramp(speed).deceleration * BRAKING.as_secs_f64()
        };
        // The largest speed of which this is true is between `speed` and the one above `too_fast`.
        let (mut speed, mut too_fast) = (0, wanted);
        if stops_in_time(wanted) {
            speed = wanted;
        }
        while speed < wanted && too_fast - speed > 1 {
            let middle = speed + (too_fast - speed) / 2;
            if stops_in_time(middle) { speed = middle } else { too_fast = middle }
        }
        Axle { axis, speed, wanted, before, unit, factor, ramp: ramp(f64::from(speed)) }
    }

    /// The target for an axis at `position` with `speed`, in the module's units, that has fuel `left`.
    pub(super) fn target(&self, position: i32, speed: i32, rightwards: bool, left: Duration) -> i32 {
        let wanted = f64::from(self.speed) * self.factor;
        let way = self.ramp.way(
            f64::from(speed) * self.factor,
            if rightwards { wanted } else { -wanted },
            left.as_secs_f64(),
        );
        position.saturating_add(way.round() as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAMP: Ramp = Ramp { acceleration: 10_000.0, deceleration: 20_000.0 };

    /// From rest to 1000 in 0.1 s, 50 microsteps; then 0.04 s at that speed, 40; the stop takes 1000^2 / 40000 = 25.
    #[test]
    fn a_key_is_a_way_of_the_time_and_a_stop() {
        let way = |speed, wanted, time| (RAMP.way(speed, wanted, time) * 1000.0).round() / 1000.0;
        assert_eq!(way(0.0, 1000.0, 0.14), 115.0);
        assert_eq!(way(0.0, -1000.0, 0.14), -115.0);
        // At full speed it is 140 and the stop.
        assert_eq!(way(1000.0, 1000.0, 0.14), 165.0);
        // In 0.05 s it gets to 500, in 12.5 microsteps; 500^2 / 40000 = 6.25.
        assert_eq!(way(0.0, 1000.0, 0.05), 18.75);
        // Faster than wanted: 0.05 s from 2000 to 1000, 75; 0.09 s, 90; the stop.
        assert_eq!(way(2000.0, 1000.0, 0.14), 190.0);
    }

    /// From -1000 it stops in 0.05 s, 25 microsteps to the left; 0.09 s are left: to 900, 40.5, and 900^2 / 40000 =
    /// 20.25.
    #[test]
    fn the_other_direction_begins_with_a_stop() {
        assert_eq!((RAMP.way(-1000.0, 1000.0, 0.14) * 1000.0).round() / 1000.0, 35.75);
        // With no time left it comes to rest where it can.
        assert_eq!(RAMP.way(-1000.0, 1000.0, 0.02), -25.0);
    }

    /// A stop within 90 ms at 20000 per s2 is one from 1800, at 8 microsteps per unit 225.
    #[test]
    fn a_speed_is_limited_by_the_time_that_a_stop_takes() {
        let speed = |wanted| Axle::limited(0, wanted, 100, "int", 8.0, |_| RAMP).speed;
        assert_eq!((speed(224), speed(225), speed(226), speed(2047), speed(1)), (224, 225, 225, 225, 1));
        let slow = Ramp { deceleration: 10.0, ..RAMP };
        assert_eq!(Axle::limited(0, 1000, 1000, "int", 8.0, |_| slow).speed, 0);
    }

    #[test]
    fn a_target_is_ahead_of_the_position() {
        let axle = Axle::limited(0, 125, 125, "int", 8.0, |_| RAMP);
        assert_eq!(axle.target(1000, 125, true, FUEL), 1165);
        assert_eq!(axle.target(1000, -125, false, FUEL), 835);
        assert_eq!(axle.target(i32::MAX, 125, true, FUEL), i32::MAX);
    }

    /// Up to 23 ms it is 140 ms; at 24 ms 6 * 24. At 40 ms no more than 300 - 90 - 2.5 * 40 keeps the stop in time.
    #[test]
    fn the_fuel_counts_the_round_trip() {
        let of = |millis| fuel(Duration::from_millis(millis)).as_millis();
        assert_eq!([0, 19, 23, 24, 40, 84, 1000].map(of), [140, 140, 140, 144, 110, 0, 0]);
        // At the limit both are the same: 6 * 24.7 and 210 - 2.5 * 24.7.
        let both = [LONGEST_ROUND * 6, Duration::from_millis(210) - LONGEST_ROUND * 5 / 2];
        assert_eq!(both.map(|time| time.as_millis()), [148, 148]);
    }
}
