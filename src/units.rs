//! Units: time, velocity and acceleration, motor current. Time and current have types of their own, so that mixing them
//! up with other numbers does not compile.

/// A point in time, in microseconds since the firmware started, or a span of time in microseconds. It wraps after 584
/// 000 years.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Micros(pub u64);

impl Micros {
    /// The span of `n` milliseconds.
    pub const fn from_millis(n: u64) -> Self {
        Micros(n * 1_000)
    }

    /// The number of whole milliseconds.
    pub const fn millis(self) -> u64 {
        self.0 / 1_000
    }

    /// The point in time that is `span` later.
    #[inline]
    pub const fn after(self, span: Micros) -> Self {
        Micros(self.0.wrapping_add(span.0))
    }

    /// The span since `earlier`; zero if `earlier` lies in the future.
    #[inline]
    pub const fn since(self, earlier: Micros) -> Micros {
        Micros(self.0.saturating_sub(earlier.0))
    }
}

/// A velocity or acceleration in internal units of the TMC429 (manual section 6.1), -2047..=2047.
pub type Internal = i32;

/// Largest magnitude of an internal velocity or acceleration.
pub const INTERNAL_MAX: Internal = 2047;

/// The driver's current scale CS, 0..=31: the current is (CS + 1)/32 of full scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CurrentScale(u8);

impl CurrentScale {
    /// The current scale for the value of a current parameter (6, 7, 183, 200), 0..=255: eight values give the same
    /// scale (manual chapter 4, parameter 6).
    pub const fn from_parameter(value: i32) -> Self {
        CurrentScale(((value as u32 & 0xFF) >> 3) as u8)
    }

    /// The value of the driver's CS field, 0..=31.
    pub const fn bits(self) -> u32 {
        self.0 as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn current_in_steps_of_eight() {
        assert_eq!(CurrentScale::from_parameter(0).bits(), 0);
        assert_eq!(CurrentScale::from_parameter(7).bits(), 0);
        assert_eq!(CurrentScale::from_parameter(8).bits(), 1);
        assert_eq!(CurrentScale::from_parameter(128).bits(), 16);
        assert_eq!(CurrentScale::from_parameter(255).bits(), 31);
    }
}
