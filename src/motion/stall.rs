//! The load measurements of the driver (stallGuard2) that count for stop on stall (parameter 181).
//!
//! The driver's load value is meaningless below the speed at which the motor's back-EMF can be measured, and it keeps
//! its last value while the motor stands. So a load value of zero may be left over from before the motor started. A
//! firmware that acted on it would never again let a motor start that a stall has stopped. Only a measurement counts
//! that was begun and ended above the speed of parameter 181.

use super::Error;
use super::hardware::{Driver, Known, RampGenerator};
use super::values::Values;
use crate::param::AxisParameter as P;

/// The way, in microsteps, on which the driver makes one whole measurement, wherever the way begins. One measurement
/// takes four full steps with the driver's filter (parameter 173) and one full step without, and the next one follows
/// at once. So on twice that way one has begun and ended. A full step has 2^`resolution` microsteps (parameter 140).
const fn span(filter: bool, resolution: i32) -> u32 {
    let full_steps: u32 = if filter { 8 } else { 2 };
    full_steps.unbounded_shl(resolution.unsigned_abs())
}

/// How far the motor has come in making a whole measurement above the speed of parameter 181.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Measured {
    /// Nothing is known of the motor's speed yet, or a hard stop or a new setting has made the measurement under way
    /// invalid.
    #[default]
    Nothing,
    /// The motor has not gone far enough above the speed for a whole measurement yet.
    Since {
        /// Position, in microsteps, at which the motor was last seen at or below the speed, or turning the other way.
        from: i32,
        /// The sign of the motor's speed above the speed of parameter 181; 0 while the motor is not above it.
        direction: i32,
    },
    /// A whole measurement has been made, and the motor still turns above the speed in the same direction.
    Whole {
        /// The sign of the motor's speed.
        direction: i32,
    },
}

impl Measured {
    /// Stop on stall: true if the hardware has stopped the motor for a stall. It is also true if the driver signals one
    /// by a measurement made wholly above the speed of parameter 181, and the motor is still faster than that now.
    /// `pin` is the level of the driver's output for this.
    pub(super) fn stalls(
        &mut self,
        chips: &mut (impl Driver + RampGenerator),
        known: Known,
        values: &Values,
        pin: bool,
    ) -> Result<bool, Error> {
        let above = values.get(P::StopOnStall);
        let span = span(values.is_on(P::StallGuardFilter), values.get(P::MicrostepResolution));
        let measured = self.look(known.position, known.speed, above, span) && above > 0;
        let stopped = chips.watch_stall(measured)?;
        let stalled = chips.stalled(pin);
        Ok(stopped || measured && stalled && chips.speed()?.abs() > above)
    }

    /// Takes in position (microsteps) and speed as read last. True if the driver has made a measurement wholly above
    /// the speed `above`, for which the motor goes `span` microsteps; speeds are in the unit of parameter 181.
    fn look(&mut self, position: i32, speed: i32, above: i32, span: u32) -> bool {
        let fast = speed.abs() > above;
        let direction = if fast { speed.signum() } else { 0 };
        *self = match *self {
            Measured::Whole { direction: before } if fast && before == direction => Measured::Whole { direction },
            Measured::Since { from, direction: before } if fast && (before == 0 || before == direction) => {
                let way = position.wrapping_sub(from).unsigned_abs();
                if way >= span { Measured::Whole { direction } } else { Measured::Since { from, direction } }
            }
            _ => Measured::Since { from: position, direction },
        };
        matches!(self, Measured::Whole { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With 256 microsteps per full step (resolution 8) eight full steps are 2048 microsteps and two are 512.
    #[test]
    fn the_way_of_a_whole_measurement_is_eight_full_steps_or_two_without_filter() {
        assert_eq!([span(true, 8), span(false, 8), span(true, 0), span(false, 0)], [2048, 512, 8, 2]);
    }

    #[test]
    fn a_measurement_counts_when_it_was_made_wholly_above_the_speed() {
        let mut measured = Measured::default();
        let mut look = |position, speed| measured.look(position, speed, 100, 2048);
        assert!(!look(0, 100), "at the speed is not above it");
        assert!(!look(50, 101), "from 0 on, where it was last seen at the speed");
        assert!(!look(2047, 500));
        assert!(look(2048, 500));
        assert!(look(2049, 500), "from now on each measurement is made above the speed");
        assert!(!look(3000, 99), "below the speed all begins anew");
        assert!(!look(5047, 500));
        assert!(look(5048, 500));
    }

    #[test]
    fn a_motor_that_turns_round_was_slow_in_between() {
        let mut measured = Measured::default();
        let mut look = |position, speed| measured.look(position, speed, 100, 2048);
        assert!(!look(0, 0));
        assert!(look(2048, 900));
        assert!(!look(2000, -900));
        assert!(!look(-47, -900));
        assert!(look(-48, -900));
    }

    /// The position wraps at 32 bits: from 1024 below the largest to 1024 above the smallest are 2048 microsteps.
    #[test]
    fn the_way_may_cross_the_end_of_the_numbers() {
        let mut measured = Measured::default();
        assert!(!measured.look(i32::MAX - 1023, 1, 1, 2048));
        assert!(!measured.look(i32::MIN + 1023, 2, 1, 2048));
        assert!(measured.look(i32::MIN + 1024, 2, 1, 2048));
    }
}
