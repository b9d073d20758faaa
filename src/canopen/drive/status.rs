//! The statusword (manual sections 6.1.2, 7.1.2, 8.1.2 and 9.2.2).

use super::Mode;
use super::state::State;
use crate::canopen::emcy::Emergency;
use crate::canopen::live::flags;
use crate::canopen::store::Tmcm1140;
use crate::canopen::{Nmt, Node};
use crate::device::Board;

/// There is a supply.
const VOLTAGE: u32 = 1 << 4;
/// The driver is about to become too hot.
const WARNING: u32 = 1 << 7;
/// The drive takes controlwords from the bus.
const REMOTE: u32 = 1 << 9;
/// The target is reached; in homing mode no homing is under way; at a halt and after a quick stop the motor stands.
const TARGET_REACHED: u32 = 1 << 10;
/// A limit is active: a limit switch, a software limit, or a stall.
const INTERNAL_LIMIT: u32 = 1 << 11;
/// In profile position mode the set-point has been taken; in homing mode the home position has been found.
const MODE_SPECIFIC: u32 = 1 << 12;
/// In profile position mode there has been a following error.
const FOLLOWING_ERROR: u32 = 1 << 13;
/// The motor rotates.
const MOVES: u32 = 1 << 14;
/// The motor rotates in the direction of negative positions.
const NEGATIVE: u32 = 1 << 15;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// The statusword.
    pub(in crate::canopen) fn statusword(&self) -> u32 {
        let drive = &self.drive;
        let special = match drive.motion.mode {
            Mode::ProfilePosition => drive.motion.acknowledged,
            Mode::Homing => drive.homing.attained,
            Mode::None | Mode::Velocity | Mode::ProfileVelocity => false,
        };
        let reached = match drive.state {
            State::QuickStopActive => self.stands(),
            _ if drive.motion.mode == Mode::Homing => !drive.homing.running,
            _ => drive.motion.reached,
        };
        let bit = |bit, set| if set { bit } else { 0 };
        drive.state.bits()
            | bit(VOLTAGE, !self.device.lacks_supply())
            | bit(WARNING, self.live.flags & flags::WARNING != 0)
            | bit(REMOTE, self.state == Nmt::Operational)
            | bit(TARGET_REACHED, reached)
            | bit(INTERNAL_LIMIT, self.is_limited())
            | bit(MODE_SPECIFIC, special)
            | bit(
                FOLLOWING_ERROR,
                drive.motion.mode == Mode::ProfilePosition && self.errors.shows(Emergency::FollowingError),
            )
            | bit(MOVES, self.live.speed != 0)
            | bit(NEGATIVE, self.live.speed < 0)
    }
}
