//! The statusword (manual sections 6.1.2, 7.1.2, 8.1.2 and 9.2.2).

use super::Drive;
use super::limit::outside;
use super::mode::OperationMode;
use super::plant::{Shown, stands};
use super::state::State;
use crate::canopen::cia301::nmt::Nmt;
use crate::canopen::errors::Emergency;
use crate::canopen::live::flags;
use crate::device::Circuit;

/// The supply is there.
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

impl Drive {
    /// The statusword. Inlined, because masters read it all the time: so what it shows is not put together first.
    #[inline(always)]
    pub(in crate::canopen) fn statusword<T: Circuit>(&self, shown: &Shown<'_, T>) -> u32 {
        let Shown { device, settings, live, errors, state, in_tmcl_mode } = *shown;
        let mode = self.motion.mode();
        let special = match mode {
            OperationMode::ProfilePosition => self.motion.is_acknowledged(),
            OperationMode::Homing => self.homing.is_attained(),
            OperationMode::None | OperationMode::Velocity | OperationMode::ProfileVelocity => false,
        };
        let reached = match self.power.state() {
            State::QuickStopActive => stands(device),
            _ if mode == OperationMode::Homing => !self.homing.is_running(),
            _ => self.motion.is_reached(),
        };
        // In TMCL mode, and while a homing is under way, there are no software limits.
        let outside = !in_tmcl_mode && !self.homing.is_running() && outside(settings, live).contains(&true);
        let follows = mode != OperationMode::ProfilePosition || !errors.shows(Emergency::FollowingError);
        let bit = |bit, set| if set { bit } else { 0 };
        self.power.state().bits()
            | bit(VOLTAGE, !device.lacks_supply())
            | bit(WARNING, live.flags & flags::WARNING != 0)
            | bit(REMOTE, state == Nmt::Operational)
            | bit(TARGET_REACHED, reached)
            | bit(INTERNAL_LIMIT, self.limits.are_touched() || outside)
            | bit(MODE_SPECIFIC, special)
            | bit(FOLLOWING_ERROR, !follows)
            | bit(MOVES, live.speed != 0)
            | bit(NEGATIVE, live.speed < 0)
    }
}
