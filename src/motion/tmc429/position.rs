//! 32-bit positions on a 24-bit chip.
//!
//! The chip's counter is extended by its differences, which is exact as long as less than 2^23 microsteps pass between
//! two readings (16.7 s at the chip's 500 kHz; the counter is read every millisecond). The chip's target must stay
//! within 2^23 microsteps of the motor, so a longer move goes by way of waypoints: the chip's target is put ahead of
//! the motor, and moved on long before the chip would begin to brake.

use crate::chip::tmc429::signed;

/// Furthest a waypoint lies ahead of the motor, in microsteps: a quarter of the counter's range, which leaves room for
/// any overrun.
const REACH: i32 = 1 << 22;
/// The waypoint is moved on when fewer microsteps than this are left: four times the chip's longest braking ramp, of
/// 2^19.
const RENEW: u32 = 1 << 21;

/// The position near `position` that has these low 24 bits, as the chip's counter has them; in microsteps.
pub(super) fn extend(position: i32, counter: u32) -> i32 {
    position.wrapping_add(signed(counter.wrapping_sub(position as u32), 24))
}

/// The first waypoint of a motor at `position` that is to go to `target`, all in microsteps; the target itself, if that
/// is near enough. The motor goes there the shorter way round the 32 bits.
pub(super) fn first(position: i32, target: i32) -> i32 {
    position.wrapping_add(target.wrapping_sub(position).clamp(-REACH, REACH))
}

/// The waypoint after `waypoint`, once the motor has come near that; none while it has not, or where `waypoint` is the
/// target itself. All in microsteps.
pub(super) fn next(position: i32, target: i32, waypoint: i32) -> Option<i32> {
    let near = waypoint.wrapping_sub(position).unsigned_abs() < RENEW;
    (waypoint != target && near).then(|| first(position, target))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_counter_is_extended_across_both_wraps() {
        let counter = ((i32::MAX - 5) as u32).wrapping_add(10) & 0xFF_FFFF;
        assert_eq!(extend(i32::MAX - 5, counter), i32::MIN + 4);
        assert_eq!(extend(0, 0xFF_FFFF), -1);
    }

    #[test]
    fn long_moves_go_by_waypoints() {
        let target = 1 << 26;
        assert_eq!(first(0, target), 1 << 22);
        assert_eq!(next(0, target, 1 << 22), None);
        let mut position = (1 << 22) - (1 << 21) + 1;
        let mut waypoint = next(position, target, 1 << 22).unwrap();
        assert_eq!(waypoint, position + (1 << 22));
        // From there on the motor follows: ever ahead, never further than the reach, and in the end there.
        while position != target {
            let ahead = waypoint - position;
            assert!(ahead <= REACH && (ahead >= RENEW as i32 - 1000 || waypoint == target));
            position += ahead.min(1000);
            waypoint = next(position, target, waypoint).unwrap_or(waypoint);
        }
        assert_eq!(next(position, target, waypoint), None);
    }

    #[test]
    fn the_short_way_round_across_the_32_bit_wrap() {
        // -2e9 - 2e9 = -4e9, which is 294 967 296 forwards.
        assert_eq!(first(2_000_000_000, -2_000_000_000), 2_000_000_000 + (1 << 22));
    }
}
