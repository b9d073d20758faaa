//! 32-bit positions on a 24-bit chip.
//!
//! The counter is extended by its differences, which is exact as long as less than 2^23 steps pass between
//! two looks (16.7 s at the chip's 500 kHz; we look every millisecond). The chip's target must stay within
//! 2^23 steps of the motor, so a longer move is done in legs: the target is put ahead of the motor and moved
//! on long before the chip would begin to brake.

/// Furthest the chip's target lies ahead: a quarter of its range, which leaves room for any overrun.
const REACH: i32 = 1 << 22;
/// The target is moved on when less than this is left: four times the chip's longest braking ramp of 2^19.
const RENEW: u32 = 1 << 21;

/// Where an axis is and where it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Position {
    /// Where the motor is, in microsteps.
    pub actual: i32,
    /// Where it shall go.
    pub target: i32,
    /// Where the chip has been told to go.
    pub leg: i32,
}

impl Position {
    /// Takes the chip's counter, 24 bits.
    pub(super) fn track(&mut self, counter: u32) {
        self.actual = self.extend(counter);
    }

    /// The position near the motor that has these low 24 bits.
    pub(super) fn extend(&self, counter: u32) -> i32 {
        let away = crate::chip::tmc429::signed(counter.wrapping_sub(self.actual as u32), 24);
        self.actual.wrapping_add(away)
    }

    /// Sets a new target; the shorter way round counts.
    pub(super) fn aim(&mut self, target: i32) {
        self.target = target;
        self.leg = self.next_leg();
    }

    /// Moves the leg on when the motor comes near its end; true if the chip must be told.
    pub(super) fn advance(&mut self) -> bool {
        let near = self.leg.wrapping_sub(self.actual).unsigned_abs() < RENEW;
        if self.leg == self.target || !near {
            return false;
        }
        self.leg = self.next_leg();
        true
    }

    /// Makes the motor stand at `position`, nowhere to go.
    pub(super) fn set(&mut self, position: i32) {
        *self = Position { actual: position, target: position, leg: position };
    }

    fn next_leg(&self) -> i32 {
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
    fn long_moves_go_in_legs() {
        let mut position = Position::default();
        position.aim(1 << 26);
        assert_eq!(position.leg, 1 << 22);
        assert!(!position.advance());
        position.actual = (1 << 22) - (1 << 21) + 1;
        assert!(position.advance());
        assert_eq!(position.leg, position.actual + (1 << 22));
        // From there on the motor follows: ever ahead, never further than the reach, and in the end there.
        while position.actual != 1 << 26 {
            let ahead = position.leg - position.actual;
            assert!(ahead <= REACH && (ahead >= RENEW as i32 - 1000 || position.leg == 1 << 26));
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
        assert_eq!(position.leg, 2_000_000_000 + (1 << 22));
    }
}
