//! The built-in magnetic encoder (sensOstep): a sensor chip above a magnet on the motor's shaft, which tells the
//! absolute angle within one turn as a number 0..=1023.

/// Number of counts in a turn of the shaft.
pub const COUNTS_PER_TURN: i64 = 1024;

/// The sensor, which makes counts of the rotor's angle, unless a fault keeps its reading as it is.
#[derive(Clone, Debug)]
pub struct MagneticEncoder {
    units_per_turn: i64,
    offset: i64,
    stuck: Option<u16>,
}

impl MagneticEncoder {
    /// A sensor on a motor with `units_per_turn` rotor units (1/256 of a full step) in a turn. `offset`,
    /// in the same units, is where on the rotor's scale the sensor reads zero.
    pub fn new(units_per_turn: i64, offset: i64) -> Self {
        Self { units_per_turn: units_per_turn.max(1), offset, stuck: None }
    }

    /// The sensor's reading, 0..=1023, with the rotor at `rotor` (1/256 full steps, any number of turns).
    pub fn position(&self, rotor: i64) -> u16 {
        self.stuck.unwrap_or_else(|| self.angle(rotor))
    }

    /// Fault injection: with `on` the reading stays as it is at the position `rotor`, without it follows the rotor.
    pub fn set_stuck(&mut self, on: bool, rotor: i64) {
        self.stuck = on.then(|| self.position(rotor));
    }

    fn angle(&self, rotor: i64) -> u16 {
        let within = (rotor - self.offset).rem_euclid(self.units_per_turn);
        // At most 1023, because `within` is less than a turn.
        (within * COUNTS_PER_TURN / self.units_per_turn) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fifty_units_are_one_count() {
        // 200 full steps x 256 = 51 200 units in a turn; 51 200 / 1024 = 50 units a count.
        let encoder = MagneticEncoder::new(51_200, 0);
        assert_eq!(encoder.position(0), 0);
        assert_eq!(encoder.position(49), 0);
        assert_eq!(encoder.position(50), 1);
        assert_eq!(encoder.position(51_199), 1023);
        assert_eq!(encoder.position(51_200), 0);
        assert_eq!(encoder.position(-1), 1023);
        assert_eq!(encoder.position(-51_200 * 3 + 100), 2);
    }

    #[test]
    fn the_offset_is_where_it_reads_zero() {
        let encoder = MagneticEncoder::new(51_200, 500);
        assert_eq!(encoder.position(500), 0);
        assert_eq!(encoder.position(0), 1014);
    }

    #[test]
    fn a_stuck_sensor_keeps_its_reading_until_it_is_repaired() {
        let mut encoder = MagneticEncoder::new(51_200, 0);
        encoder.set_stuck(true, 5_000);
        assert_eq!(encoder.position(20_000), 100);
        encoder.set_stuck(false, 20_000);
        assert_eq!(encoder.position(20_000), 400);
    }
}
