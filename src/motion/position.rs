//! 32-bit positions on a 24-bit chip.
//!
//! The chip's counter is extended by its differences, which is exact as long as less than 2^23 microsteps pass between
//! two readings (16.7 s at the chip's 500 kHz; the counter is read every millisecond). The chip's target must stay
//! within 2^23 microsteps of the motor, so a longer move goes by way of waypoints: the chip's target is put ahead of
//! the motor, and moved on long before the chip would begin to brake.

/// Furthest a waypoint lies ahead of the motor, in microsteps: a quarter of the counter's range, which leaves room for
/// any overrun.
const REACH: i32 = 1 << 22;
/// The waypoint is moved on when fewer microsteps than this are left: four times the chip's longest braking ramp, of
/// 2^19.
const RENEW: u32 = 1 << 21;

/// The position of an axis and its target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Position {
    /// Where the motor is, in microsteps.
    pub actual: i32,
    /// Where the motor is to go in the end, in microsteps.
    pub target: i32,
    /// The target that the chip has been given, in microsteps: on the way to `target`, or `target` itself.
    pub waypoint: i32,
}

impl Position {
    /// Takes a reading of the chip's counter, 24 bits.
    pub(super) fn track(&mut self, counter: u32) {
        self.actual = self.extend(counter);
    }

    /// The position near the motor that has these low 24 bits.
    pub(super) fn extend(&self, counter: u32) -> i32 {
        let away = crate::chip::tmc429::signed(counter.wrapping_sub(self.actual as u32), 24);
        self.actual.wrapping_add(away)
    }

    /// Sets a new target; the motor goes there the shorter way round the 32 bits.
    pub(super) fn aim(&mut self, target: i32) {
        self.target = target;
        self.waypoint = self.next_waypoint();
    }

    /// Moves the waypoint on when the motor comes near it; true if the chip must be given the new one.
    pub(super) fn advance(&mut self) -> bool {
        let near = self.waypoint.wrapping_sub(self.actual).unsigned_abs() < RENEW;
        if self.waypoint == self.target || !near {
            return false;
        }
        self.waypoint = self.next_waypoint();
        true
    }

    /// Makes `position` both position and target, so that the motor has nowhere to go.
    pub(super) fn set(&mut self, position: i32) {
        *self = Position { actual: position, target: position, waypoint: position };
    }

    fn next_waypoint(&self) -> i32 {
        let distance = self.target.wrapping_sub(self.actual);
        self.actual.wrapping_add(distance.clamp(-REACH, REACH))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_counter_is_extended_across_both_wraps() {
        let mut position = Position::default();
        position.set(i32::MAX - 5);
        position.track(((i32::MAX - 5) as u32).wrapping_add(10) & 0xFF_FFFF);
        assert_eq!(position.actual, i32::MIN + 4);
        position.set(0);
        position.track(0xFF_FFFF);
        assert_eq!(position.actual, -1);
    }

    #[test]
    fn long_moves_go_by_waypoints() {
        let mut position = Position::default();
        position.aim(1 << 26);
        assert_eq!(position.waypoint, 1 << 22);
        assert!(!position.advance());
        position.actual = (1 << 22) - (1 << 21) + 1;
        assert!(position.advance());
        assert_eq!(position.waypoint, position.actual + (1 << 22));
        // From there on the motor follows: ever ahead, never further than the reach, and in the end there.
        while position.actual != 1 << 26 {
            let ahead = position.waypoint - position.actual;
            assert!(ahead <= REACH && (ahead >= RENEW as i32 - 1000 || position.waypoint == 1 << 26));
            position.actual += ahead.min(1000);
            position.advance();
        }
        assert!(!position.advance());
    }

    #[test]
    fn the_short_way_round_across_the_32_bit_wrap() {
        let mut position = Position::default();
        position.set(2_000_000_000);
        position.aim(-2_000_000_000);
        // -2e9 - 2e9 = -4e9, which is 294 967 296 forwards.
        assert_eq!(position.waypoint, 2_000_000_000 + (1 << 22));
    }
}
