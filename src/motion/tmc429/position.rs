//! 32-bit positions on the TMC429, whose counter and target have 24 bits.
//!
//! The chip's counter is extended by the difference of each reading from the one before. This is exact as long as the
//! motor moves by less than 2^23 microsteps between two readings. At the chip's 500 kHz it makes these in 16.7 s, and
//! the counter is read every millisecond. The chip's target must stay within 2^23 microsteps of the motor, so a longer
//! move goes by way of waypoints. The chip's target is put ahead of the motor, and moved on long before the chip would
//! begin to brake.

use crate::chip::tmc429::signed;

/// Distance, in microsteps, that a waypoint is put ahead of the motor at most. It is a quarter of the counter's range,
/// so that an overrun does not bring the motor to the far half.
const REACH: i32 = 1 << 22;
/// A waypoint is moved on when the motor has fewer microsteps than this to go to it: four times the chip's longest
/// braking ramp, which has 2^19 microsteps.
const RENEW: u32 = 1 << 21;

/// The microsteps that a motor may make between two readings at most: half of what the counter allows.
pub(super) const EXTENDED: u32 = 1 << 22;

/// The microsteps that a motor may make before its waypoint is moved on, if it has `left` to go to it.
pub(super) fn room(left: u32) -> u32 {
    left.saturating_sub(RENEW).min(EXTENDED)
}

/// The position that is nearest to `position` among those whose low 24 bits are `counter`, as the chip counts; in
/// microsteps.
pub(super) fn extend(position: i32, counter: u32) -> i32 {
    position.wrapping_add(signed(counter.wrapping_sub(position as u32), 24))
}

/// The first waypoint of a motor at `position` that is to go to `target`, or the target itself if that is near enough;
/// all in microsteps. The motor goes the shorter way round the 32 bits.
pub(super) fn first(position: i32, target: i32) -> i32 {
    position.wrapping_add(target.wrapping_sub(position).clamp(-REACH, REACH))
}

/// The waypoint after `waypoint`; all in microsteps. `None` while the motor at `position` has not come near `waypoint`,
/// and where `waypoint` is the target itself.
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
        // The waypoint always stays ahead of the motor, never further than the reach, and in the end is the target.
        while position != target {
            let ahead = waypoint - position;
            assert!(ahead <= REACH && (ahead >= RENEW as i32 - 1000 || waypoint == target));
            position += ahead.min(1000);
            waypoint = next(position, target, waypoint).unwrap_or(waypoint);
        }
        assert_eq!(next(position, target, waypoint), None);
    }

    /// 2^21 microsteps before its waypoint a motor gets another one, and 2^22 between two readings are half of what is
    /// counted.
    #[test]
    fn a_motor_may_turn_on_until_its_waypoint_is_moved() {
        let rooms = [0, 1 << 21, (1 << 21) + 5, 1 << 22, 3 << 21, u32::MAX].map(room);
        assert_eq!(rooms, [0, 0, 5, 1 << 21, 1 << 22, 1 << 22]);
    }

    #[test]
    fn the_short_way_round_across_the_32_bit_wrap() {
        // From 2 000 000 000 back to -2 000 000 000 are 4 000 000 000 microsteps, and forwards 2^32 less: 294 967 296.
        assert_eq!(first(2_000_000_000, -2_000_000_000), 2_000_000_000 + (1 << 22));
    }
}
