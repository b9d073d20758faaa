//! How fast the field turns, for the torque that there is at a speed.

use super::{FULL_STEP, PERIOD};
use crate::clock::{Nanos, SECOND};

/// The measurement of the field's speed: from one multiple of an electrical period to the next. The steps that pass one
/// are whole full steps, of which a motor is always told by themselves. So the measurement does not depend on how many
/// of the steps in between it is told at once.
#[derive(Clone, Debug)]
pub(super) struct Speed {
    /// The number of the period in which the field is.
    period: i64,
    /// Where the field was as it came there, and when.
    field: i64,
    since: Nanos,
    /// The duration of the last period; 0 for a field that rests.
    took: Nanos,
    /// The mean speed in that period, in full steps per second, without sign.
    value: f64,
}

impl Speed {
    /// A field that rests there.
    pub(super) fn resting(field: i64) -> Self {
        Self { period: field.div_euclid(PERIOD), field, since: 0, took: 0, value: 0.0 }
    }

    /// Full steps per second, without sign.
    pub(super) fn value(&self) -> f64 {
        self.value
    }

    /// The time at which a field that made its last step at `last` counts as resting: no step has come for as long as
    /// the last period took. `None` for one that rests already.
    #[inline]
    pub(super) fn rests_at(&self, last: Nanos) -> Option<Nanos> {
        (self.took != 0).then(|| last + self.took)
    }

    /// The field rests from now on.
    #[cold]
    pub(super) fn rest(&mut self) {
        (self.took, self.value) = (0, 0.0);
    }

    /// The field has come to `field` at `at`. Returns whether the speed is measured anew.
    #[inline]
    pub(super) fn measure(&mut self, at: Nanos, field: i64) -> bool {
        let period = field.div_euclid(PERIOD);
        let passes = period != self.period;
        if passes {
            self.pass(at, field, period);
        }
        passes
    }

    fn pass(&mut self, at: Nanos, field: i64, period: i64) {
        let took = at.saturating_sub(self.since).max(1);
        let moved = field.abs_diff(self.field);
        let value = moved as f64 / FULL_STEP as f64 * SECOND as f64 / took as f64;
        *self = Self { period, field, since: at, took, value };
    }
}
