//! Which stallGuard2 measurements count for stop on stall (parameter 181).
//!
//! The driver's load value is meaningless below the speed at which the motor's back-EMF can be measured, and it keeps
//! its last value while the motor stands. So a load value of zero may be left over from before the motor started: a
//! firmware that acted on it would never let a motor start again that a stall has stopped. Only a measurement counts
//! that was begun and ended above the speed of parameter 181.

/// The way, in microsteps, in which the driver makes one whole measurement wherever it begins. It measures for four
/// full steps with its filter (parameter 173) and for one without, one measurement after another: in twice that time
/// one of them has begun and ended. A full step has 2^`resolution` microsteps (parameter 140).
pub(super) const fn span(filter: bool, resolution: i32) -> u32 {
    let full_steps: u32 = if filter { 8 } else { 2 };
    full_steps.unbounded_shl(resolution.unsigned_abs())
}

/// Whether a whole measurement has been made above a speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Measured {
    /// The speed has not been looked at since the measurement began anew.
    #[default]
    Nothing,
    /// Not for a whole measurement yet.
    Since {
        /// Where the motor was last seen at or below the speed, or turning the other way, in microsteps.
        from: i32,
        /// The sign of its speed above that, 0 before.
        direction: i32,
    },
    /// A whole measurement has been made, and the motor turns on in this direction.
    Whole {
        /// The sign of its speed.
        direction: i32,
    },
}

impl Measured {
    /// Takes position and speed as the last datagrams have told them. True if the driver has made a measurement wholly
    /// above the speed `above`, in the `span` of microsteps that this takes.
    pub(super) fn look(&mut self, position: i32, speed: i32, above: i32, span: u32) -> bool {
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

    /// With 256 microsteps eight full steps are 2048 microsteps, two are 512; with full steps they are 8 and 2.
    #[test]
    fn the_way_of_a_whole_measurement() {
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
