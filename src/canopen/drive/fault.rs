//! The causes of faults, and of other emergencies that last for a time (manual section 5.1.5 and chapter 10). What each
//! of them leads to is in the table of `errors.rs`.

use super::plant::Plant;
use super::power::Power;
use crate::canopen::errors::Emergency as E;
use crate::canopen::live::{Live, flags};
use crate::canopen::object::Object;
use crate::device::Circuit;

/// Bit of 2005h: the shutdown input is in use.
const SHUTDOWN_INPUT: u32 = 1 << 6;
/// The shutdown input, IN0. While it is low, the signal that lets the motor run is missing.
const IN0: u16 = 1;

/// Number of turns, one in a millisecond, for which the driver tells of an open load before that counts. Its flags are
/// right only while the motor moves with some current (TMC262 datasheet, chapter on diagnostics).
const OPEN_LOAD: u8 = 20;

/// Number of causes.
const CAUSES: usize = 13;

/// Number of turns for which the driver has told of an open load at bridge A and at bridge B while the motor moves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OpenLoad([u8; 2]);

impl OpenLoad {
    /// Takes the flags of a turn. Returns whether the load of each bridge is open. Of a motor that stands nothing new
    /// is known: an open load that counts is over when the motor moves without it.
    pub(super) fn turn(&mut self, live: &Live) -> [bool; 2] {
        let moves = live.speed != 0;
        for (turns, flag) in self.0.iter_mut().zip([flags::OPEN_A, flags::OPEN_B]) {
            if moves && live.flags & flag != 0 {
                *turns = turns.saturating_add(1);
            } else if moves || *turns < OPEN_LOAD {
                *turns = 0;
            }
        }
        self.0.map(|turns| turns >= OPEN_LOAD)
    }
}

/// The emergencies that last for a time, and whether the cause of each exists.
pub(super) fn causes<T: Circuit>(
    plant: &Plant<'_, T>,
    power: &Power,
    [open_a, open_b]: [bool; 2],
) -> [(E, bool); CAUSES] {
    let flag = |flag| plant.live.flags & flag != 0;
    let is_unknown = plant.lost.is_some_and(|lost| !lost.is_empty());
    let is_silent = plant.device.store().is_unreachable();
    let shutdown = plant.settings.of(Object::LimitSwitches) & SHUTDOWN_INPUT != 0;
    [
        (E::OpenLoadA, open_a),
        (E::OpenLoadB, open_b),
        (E::OverCurrentA, flag(flags::SHORT_A)),
        (E::OverCurrentB, flag(flags::SHORT_B)),
        (E::TemperatureWarning, flag(flags::WARNING)),
        (E::OverTemperature, flag(flags::OVERTEMPERATURE)),
        (E::SilentController, plant.device.is_given_up()),
        (E::SilentEeprom, is_unknown && is_silent),
        (E::SettingsLost, is_unknown && !is_silent),
        (E::Shutdown, shutdown && plant.live.inputs & IN0 == 0),
        (E::MasterLost, plant.has_lost_master),
        (E::FollowingError, power.has_following_error(plant)),
        (E::UnderVoltage, plant.device.lacks_supply()),
    ]
}
