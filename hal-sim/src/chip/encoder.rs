//! The built-in magnetic encoder (sensOstep): a sensor chip above a magnet on the motor's shaft, which tells the
//! absolute angle within one turn as a number 0..=1023.

use crate::clock::{MILLISECOND, Nanos};
use crate::random::Random;

/// Number of counts in a turn of the shaft.
pub const COUNTS_PER_TURN: i64 = 1024;

/// The sensor, which makes counts of the rotor's angle, unless a fault keeps its reading as it is.
#[derive(Clone, Debug)]
pub struct MagneticEncoder {
    units_per_turn: i64,
    offset: i64,
    noise: u32,
    seed: u64,
    stuck: Option<u16>,
}

impl MagneticEncoder {
    /// A sensor on a motor with `units_per_turn` rotor units (1/256 of a full step) in a turn. `offset`, in the same
    /// units, is where on the rotor's scale the sensor reads zero. Its readings are off by up to `noise` counts, as
    /// `seed` has it.
    pub fn new(units_per_turn: i64, offset: i64, noise: u32, seed: u64) -> Self {
        Self { units_per_turn: units_per_turn.max(1), offset, noise, seed, stuck: None }
    }

    /// The sensor's reading at a time, 0..=1023, with the rotor at `rotor` (1/256 full steps, any number of turns). It
    /// depends on nothing else, so that nobody who looks changes what another one sees.
    pub fn position(&self, rotor: i64, now: Nanos) -> u16 {
        self.stuck.unwrap_or_else(|| self.angle(rotor, now))
    }

    /// Fault injection: with `on` the reading stays as it is at the position `rotor`, without it follows the rotor.
    pub fn set_stuck(&mut self, on: bool, rotor: i64, now: Nanos) {
        self.stuck = on.then(|| self.position(rotor, now));
    }

    /// Whether the reading stays while the rotor does.
    pub fn is_quiet(&self) -> bool {
        self.noise == 0
    }

    fn angle(&self, rotor: i64, now: Nanos) -> u16 {
        let within = (rotor - self.offset).rem_euclid(self.units_per_turn);
        let count = within * COUNTS_PER_TURN / self.units_per_turn;
        // 0..=1023, because it is less than a turn.
        (count + self.error(now)).rem_euclid(COUNTS_PER_TURN) as u16
    }

    /// By how many counts the reading is off: another number in each millisecond, in which a module reads it once.
    fn error(&self, now: Nanos) -> i64 {
        if self.is_quiet() {
            return 0;
        }
        let mut random = Random::new(self.seed ^ (now / MILLISECOND).rotate_left(32));
        i64::from(random.below(2 * self.noise + 1)) - i64::from(self.noise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fifty_units_are_one_count() {
        // 200 full steps x 256 = 51 200 units in a turn; 51 200 / 1024 = 50 units a count.
        let encoder = MagneticEncoder::new(51_200, 0, 0, 1);
        assert_eq!(encoder.position(0, 0), 0);
        assert_eq!(encoder.position(49, 0), 0);
        assert_eq!(encoder.position(50, 0), 1);
        assert_eq!(encoder.position(51_199, 0), 1023);
        assert_eq!(encoder.position(51_200, 0), 0);
        assert_eq!(encoder.position(-1, 0), 1023);
        assert_eq!(encoder.position(-51_200 * 3 + 100, 0), 2);
    }

    #[test]
    fn the_offset_is_where_it_reads_zero() {
        let encoder = MagneticEncoder::new(51_200, 500, 0, 1);
        assert_eq!(encoder.position(500, 0), 0);
        assert_eq!(encoder.position(0, 0), 1014);
    }

    #[test]
    fn a_stuck_sensor_keeps_its_reading_until_it_is_repaired() {
        let mut encoder = MagneticEncoder::new(51_200, 0, 0, 1);
        encoder.set_stuck(true, 5_000, 0);
        assert_eq!(encoder.position(20_000, 0), 100);
        encoder.set_stuck(false, 20_000, 0);
        assert_eq!(encoder.position(20_000, 0), 400);
    }

    /// With two counts of noise the readings are the five from 98 to 102, each as often as another.
    #[test]
    fn noise_is_another_one_in_each_millisecond_and_the_same_for_all_who_look() {
        let encoder = MagneticEncoder::new(51_200, 0, 2, 7);
        let mut seen = [0; 5];
        for now in (0..5_000).map(|number| number * MILLISECOND) {
            let reading = encoder.position(5_000, now);
            assert_eq!(encoder.position(5_000, now + MILLISECOND - 1), reading);
            seen[usize::from(reading - 98)] += 1;
        }
        assert!(seen.iter().all(|times| (850..1_150).contains(times)), "{seen:?}");
        let reading = encoder.position(0, 0);
        assert!(reading <= 2 || reading >= 1_022, "{reading}");
    }
}
