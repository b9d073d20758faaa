//! How fast a motor is on its way up to its top speed, and down from it. With the way from rest, or to rest, the square
//! of the speed grows in proportion. Here squares of speeds are in 1/256 of the square of the unit of
//! [`Profile`](super::Profile).

/// The slope of a ramp, of one piece or of two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slope {
    /// The square of the speed with which it begins.
    begin: u64,
    /// The way of the first piece, in microsteps.
    knee: u32,
    /// By what the square of the speed grows with each microstep, in the first piece.
    first: u32,
    /// By what the square of the speed grows with each microstep, in the second piece.
    second: u32,
}

/// Both slopes of a move from rest to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slopes {
    /// The acceleration that was asked for, as the ramp generator really makes it, in the unit of parameter 5.
    pub acceleration: i32,
    /// The slope up to the top speed, with the way that the motor has come.
    pub up: Slope,
    /// The slope down from it, with the way that is left.
    pub down: Slope,
}

impl Slope {
    /// A slope of one piece that begins at rest; `square` is by what the square of the speed grows with each microstep.
    pub const fn straight(square: u32) -> Self {
        Slope { begin: 0, knee: 0, first: square, second: square }
    }

    /// A slope that begins at the speed `start`, and whose first piece ends at the speed `end`; without one if that is
    /// below. `first` and `second` are by what the square of the speed grows with each microstep.
    pub fn bent(start: u32, end: u32, first: u32, second: u32) -> Self {
        let [begin, end] = [start, end].map(|speed| u64::from(speed).wrapping_mul(speed.into()) << 8);
        let knee = end.saturating_sub(begin).checked_div(first.into()).unwrap_or(u32::MAX.into());
        match knee.min(u32::MAX.into()) as u32 {
            0 => Slope { begin, knee: 0, first: second, second },
            knee => Slope { begin, knee, first, second },
        }
    }

    /// The square of the speed after a way, in microsteps.
    pub fn square(&self, way: u32) -> u64 {
        let first = u64::from(way.min(self.knee)).wrapping_mul(self.first.into());
        let second = u64::from(way.saturating_sub(self.knee)).wrapping_mul(self.second.into());
        self.begin.wrapping_add(first).wrapping_add(second)
    }

    /// The way after which the motor has a speed.
    pub fn way(&self, speed: u32) -> u32 {
        let risen = (u64::from(speed).wrapping_mul(speed.into()) << 8).saturating_sub(self.begin);
        let in_first = u64::from(self.knee).wrapping_mul(self.first.into());
        let way = match risen.checked_sub(in_first) {
            Some(beyond) => beyond.checked_div(self.second.into()).map(|way| way.wrapping_add(self.knee.into())),
            None => risen.checked_div(self.first.into()),
        };
        way.unwrap_or_default().min(u32::MAX.into()) as u32
    }

    /// By what the square of the speed grows with the first microstep.
    pub const fn foot(&self) -> u32 {
        self.first
    }

    /// By what the square of the speed grows with a microstep in the second piece.
    pub const fn main(&self) -> u32 {
        self.second
    }
}

/// The integer square root.
pub fn root(square: u64) -> u32 {
    // Most squares of speeds are so small, and their roots are found much faster.
    match u32::try_from(square) {
        Ok(square) => square.isqrt(),
        Err(_) => square.isqrt() as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 2 a x with a = 500: after 1000 microsteps the square of the speed is 1e6.
    #[test]
    fn a_straight_slope_is_a_constant_acceleration() {
        let slope = Slope::straight(1000 << 8);
        assert_eq!((slope.square(1000) >> 8, slope.way(1000)), (1_000_000, 1000));
        assert_eq!(root(slope.square(1000) >> 8), 1000);
    }

    /// From 100 at 2 a = 200 the speed is 300 after (300^2 - 100^2) / 200 = 400 microsteps. Then at 2 a = 100 it is 500
    /// after (500^2 - 300^2) / 100 = 1600 more.
    #[test]
    fn a_bent_slope_has_two_accelerations() {
        let slope = Slope::bent(100, 300, 200 << 8, 100 << 8);
        assert_eq!([0, 400, 2000].map(|way| root(slope.square(way) >> 8)), [100, 300, 500]);
        assert_eq!([50, 300, 500].map(|speed| slope.way(speed)), [0, 400, 2000]);
        assert_eq!(Slope::bent(0, 0, 200, 100), Slope::straight(100));
    }

    #[test]
    fn roots_are_those_of_large_squares_too() {
        assert_eq!([root(99), root(1 << 40), root(7_999_512 * 7_999_512)], [9, 1 << 20, 7_999_512]);
    }
}
