//! The dimension of velocities (208Ch), and the largest values that the motion controller can make of them.

/// The clock of the TMC429 in Hz.
const CLOCK: u64 = 16_000_000;
/// Largest velocity and acceleration of the TMC429, in internal units.
pub(super) const INTERNAL: u32 = 2047;

/// The dimension of velocities and accelerations, by the numbers of 208Ch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dimension {
    Internal,
    /// Revolutions per minute, and these per second.
    Rpm,
    /// Microsteps per second, and these per second.
    Pps,
}

impl Dimension {
    /// The dimension with this number of 208Ch.
    pub(super) const fn numbered(number: u32) -> Self {
        match number {
            164 => Dimension::Rpm,
            181 => Dimension::Pps,
            _ => Dimension::Internal,
        }
    }

    /// The number of 208Eh.
    pub(super) const fn of_acceleration(self) -> u32 {
        match self {
            Dimension::Internal => 0,
            Dimension::Rpm => 177,
            Dimension::Pps => 179,
        }
    }

    /// The largest velocity of a motor with this many microsteps in a turn: that of internal velocity 2047 with
    /// PULSE_DIV 0.
    pub(super) fn largest_velocity(self, turn: u32) -> u32 {
        self.scaled(u64::from(INTERNAL).saturating_mul(CLOCK), 16, turn)
    }

    /// The largest acceleration: that of internal acceleration 2047 with PULSE_DIV and RAMP_DIV 0.
    pub(super) fn largest_acceleration(self, turn: u32) -> u32 {
        // The clock's square times 2047 is 2^8 times this, so that it fits 64 bits with the factor of a minute.
        self.scaled(u64::from(INTERNAL).saturating_mul(CLOCK).saturating_mul(CLOCK >> 8), 29 - 8, turn)
    }

    /// A value in microsteps times 2^`shift`, in this dimension.
    fn scaled(self, value: u64, shift: u32, turn: u32) -> u32 {
        let number = match self {
            Dimension::Internal => return INTERNAL,
            Dimension::Pps => value.unbounded_shr(shift),
            Dimension::Rpm => {
                value.saturating_mul(60).unbounded_shr(shift).checked_div(turn.into()).unwrap_or_default()
            }
        };
        u32::try_from(number).unwrap_or(u32::MAX)
    }
}

/// How velocities and accelerations become those of the motion controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Scale;

impl Scale {
    /// A velocity in internal units, as near as can be.
    pub(super) fn velocity(self, velocity: i64) -> i32 {
        let largest = i64::from(INTERNAL);
        velocity.clamp(largest.saturating_neg(), largest) as i32
    }

    /// An acceleration in internal units, at least 1, so that a motor can always be stopped.
    pub(super) fn acceleration(self, acceleration: u32) -> i32 {
        acceleration.clamp(1, INTERNAL) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_values_are_those_of_the_datasheet() {
        let turn = 200 * 256;
        let (velocity, acceleration) =
            (2047.0 * 16e6 / f64::from(1 << 16), 2047.0 * 16e6 * 16e6 / f64::from(1_u32 << 29));
        assert_eq!(Dimension::Pps.largest_velocity(turn), velocity as u32);
        assert_eq!(Dimension::Pps.largest_velocity(turn), 499_755);
        assert_eq!(Dimension::Rpm.largest_velocity(turn), (velocity * 60.0 / f64::from(turn)) as u32);
        assert_eq!(Dimension::Pps.largest_acceleration(turn), acceleration as u32);
        assert_eq!(Dimension::Rpm.largest_acceleration(turn), (acceleration * 60.0 / f64::from(turn)) as u32);
        assert_eq!(
            (Dimension::Internal.largest_velocity(turn), Dimension::Internal.largest_acceleration(1)),
            (2047, 2047)
        );
    }
}
