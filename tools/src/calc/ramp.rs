//! Ramps: the way and the time of a move, with the formulas of constant acceleration. Ways are in microsteps, speeds in
//! pps, accelerations in pps2, times in seconds.

/// How a ramp leaves standstill, or comes to it: at once to `edge`, with `first` up to `knee`, with `main` above it.
/// Most have `main` alone, with the others at 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Side {
    /// The speed with which it begins or ends: VSTART or VSTOP.
    pub(super) edge: f64,
    /// The acceleration up to `knee`: A1 or D1.
    pub(super) first: f64,
    /// The speed at which one acceleration gives way to the other: V1; 0 if there is one alone.
    pub(super) knee: f64,
    /// The acceleration from there on: AMAX or DMAX, above 0.
    pub(super) main: f64,
}

/// A part of a move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Leg {
    pub(super) way: f64,
    pub(super) time: f64,
}

/// A move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Move {
    /// The highest speed that it has.
    pub(super) top: f64,
    /// Speeding up, at full speed, and slowing down.
    pub(super) legs: [Leg; 3],
}

impl Side {
    /// A side with one acceleration.
    pub(super) fn plain(main: f64) -> Self {
        Side { main, ..Side::default() }
    }

    /// The leg between standstill and a speed.
    pub(super) fn leg(&self, speed: f64) -> Leg {
        let edge = self.edge.min(speed);
        let knee = self.knee.clamp(edge, speed);
        constant(self.first, edge, knee) + constant(self.main, knee, speed)
    }
}

/// The leg between two speeds, of which the second is not below the first, with one acceleration.
fn constant(acceleration: f64, from: f64, to: f64) -> Leg {
    if to <= from {
        return Leg::default();
    }
    Leg { way: (to * to - from * from) / (2.0 * acceleration), time: (to - from) / acceleration }
}

impl std::ops::Add for Leg {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Leg { way: self.way + other.way, time: self.time + other.time }
    }
}

/// The move over a way above 0 with a speed limit above 0: a trapezoid if the way is long enough to get there, else a
/// triangle.
pub(super) fn travel(up: &Side, down: &Side, way: f64, limit: f64) -> Move {
    let both = |speed: f64| up.leg(speed).way + down.leg(speed).way;
    let (mut low, mut top) = (0.0, limit);
    if both(limit) > way {
        // The way grows with the speed, so halving the interval finds the speed that it is just enough for; after so
        // many halvings nothing is left of it.
        for _ in 0..100 {
            let middle = (low + top) / 2.0;
            if both(middle) > way {
                top = middle;
            } else {
                low = middle;
            }
        }
    }
    let (up, down) = (up.leg(top), down.leg(top));
    let rest = (way - up.way - down.way).max(0.0);
    Move { top, legs: [up, Leg { way: rest, time: rest / top }, down] }
}

impl Move {
    /// All of it.
    pub(super) fn whole(&self) -> Leg {
        self.legs.iter().fold(Leg::default(), |whole, leg| whole + *leg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-6 * expected.abs().max(1.0), "{found}, not {expected}");
    }

    /// 1000 pps with 500 pps2: 2 s and v^2 / 2a = 1000 microsteps to get there, and the same back; of 5000 microsteps
    /// 3000 are left for 3 s.
    #[test]
    fn a_long_way_is_a_trapezoid() {
        let side = Side::plain(500.0);
        let found = travel(&side, &side, 5_000.0, 1_000.0);
        let expected = [(1_000.0, 2.0), (3_000.0, 3.0), (1_000.0, 2.0)];
        for (leg, (way, time)) in found.legs.iter().zip(expected) {
            near(leg.way, way);
            near(leg.time, time);
        }
        near(found.whole().time, 7.0);
    }

    /// Of 500 microsteps 250 are for each side: v = sqrt(2 * 500 * 250) = 500, in 1 s each.
    #[test]
    fn a_short_way_is_a_triangle() {
        let side = Side::plain(500.0);
        let found = travel(&side, &side, 500.0, 1_000.0);
        near(found.top, 500.0);
        near(found.whole().time, 2.0);
        near(found.whole().way, 500.0);
        // With twice the deceleration two thirds of the way are for speeding up: v = sqrt(2 * 500 * 500 * 2 / 3).
        let found = travel(&side, &Side::plain(1_000.0), 500.0, 1_000.0);
        near(found.top, (1_000_000.0_f64 / 3.0).sqrt());
    }

    /// 100 to 500 pps with 200 pps2 are 2 s and (500^2 - 100^2) / 400 = 600 microsteps. From there to 1000 pps with 500
    /// pps2 are 1 s and 750 microsteps. Back to 500 pps with 250 pps2 are 2 s and 1500 microsteps, to 0 with 1000 pps2
    /// 0.5 s and 125 microsteps.
    #[test]
    fn six_points_make_a_ramp() {
        let up = Side { edge: 100.0, first: 200.0, knee: 500.0, main: 500.0 };
        let down = Side { edge: 0.0, first: 1_000.0, knee: 500.0, main: 250.0 };
        let found = travel(&up, &down, 3_975.0, 1_000.0);
        let expected = [(1_350.0, 3.0), (1_000.0, 1.0), (1_625.0, 2.5)];
        for (leg, (way, time)) in found.legs.iter().zip(expected) {
            near(leg.way, way);
            near(leg.time, time);
        }
        // At 300 pps, below the knee: (300^2 - 100^2) / 400 = 200 and 300^2 / 2000 = 45 microsteps.
        near(travel(&up, &down, 245.0, 1_000.0).top, 300.0);
    }
}
