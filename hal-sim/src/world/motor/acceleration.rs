//! How fast the field speeds up or slows down, for the torque that inertia demands.

use super::{FULL_STEP, PERIOD};
use crate::clock::{Nanos, SECOND};

/// A field that takes longer than this for an electrical period counts as resting in the measurement of acceleration.
const REST: Nanos = SECOND / 10;

/// The measurement of the field's acceleration, over electrical periods.
#[derive(Clone, Debug, Default)]
pub(super) struct Acceleration {
    /// The time at which the present electrical period began.
    since: Nanos,
    /// How far the field has moved since then.
    moved: i64,
    /// The mean speed over the last electrical period, with its sign, in 1/1000 full step per second, and the duration
    /// of that period in nanoseconds.
    speed: Option<(i64, i64)>,
    demand: u32,
}

impl Acceleration {
    /// The torque that the acceleration demands, in 1/65536 of the torque at full current.
    pub(super) fn demand(&self) -> u32 {
        self.demand
    }

    /// An electrical period begins at `at`.
    pub(super) fn begin(&mut self, at: Nanos) {
        self.since = at;
    }

    /// The field has moved by `delta` at `at`. Measures its speed over electrical periods, and its acceleration from
    /// one period to the next. The acceleration is the change of the mean speeds over the time between the middles of
    /// the two periods. The first period after a rest only gives a speed to start from. Returns whether the demand is
    /// measured anew.
    #[cold]
    pub(super) fn measure(&mut self, at: Nanos, delta: i64, inertia: u32) -> bool {
        self.moved += delta;
        let took = at.saturating_sub(self.since);
        if took > REST {
            *self = Self { since: at, ..Self::default() };
        } else if self.moved.abs() >= PERIOD && took > 0 {
            let (second, took) = (SECOND as i64, took as i64);
            let speed = self.moved * second / FULL_STEP * 1000 / took;
            self.demand = self.speed.map_or(0, |(before, took_before)| {
                let change = (speed - before).unsigned_abs(); // 1/1000 full step/s
                let between = (took + took_before).unsigned_abs() / 2;
                let demand =
                    u128::from(change) * u128::from(SECOND) / u128::from(between) * u128::from(inertia) / 1_000_000;
                demand.min(u128::from(u32::MAX)) as u32
            });
            self.speed = Some((speed, took));
            self.since = at;
            self.moved = 0;
        } else {
            return false;
        }
        true
    }
}
