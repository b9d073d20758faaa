//! The limits within which the motor is kept: software limits (manual section 6.1.11), limit switches, and stop on
//! stall (section 4.2.31). Each stops the motor, sends an emergency message and shows in bit 11 of the statusword; the
//! drive stays in OPERATION ENABLED, and commands that lead back are obeyed.
//!
//! The motion controller itself, or for a switch that it does not watch the axis, stops the motor at a limit switch. A
//! software limit stops it along the ramp. So the motor runs past the limit by the way of that ramp, and of the
//! millisecond in which the limit was noticed.

use super::plant::Plant;
use super::task::Task;
use crate::canopen::errors::Emergency;
use crate::canopen::live::Live;
use crate::canopen::object::Object;
use crate::canopen::settings::Settings;
use crate::device::Circuit;

/// The emergencies of the two ends, that of negative positions first.
const SOFTWARE: [Emergency; 2] = [Emergency::NegativeSoftwareLimit, Emergency::PositiveSoftwareLimit];
const SWITCH: [Emergency; 2] = [Emergency::NegativeLimitSwitch, Emergency::PositiveLimitSwitch];

/// The state of the limits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Limits {
    /// The limit switch of each end, that of negative positions first, has stopped the motor and is still closed.
    touched: [bool; 2],
    /// The motor has stalled, and has not been told anything since.
    stalled: bool,
}

impl Limits {
    /// Looks at the ends of the way, once in each turn, for a motor that is asked for this.
    pub(super) fn watch_ends<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, asked: Task) {
        let towards = [plant.live.speed, asked.direction(plant.live.position)];
        let (outside, closed) = (outside(plant.settings, plant.live), closed(plant.settings, plant.live));
        let heads = [towards.into_iter().any(i32::is_negative), towards.into_iter().any(i32::is_positive)];
        for (end, heads) in heads.into_iter().enumerate() {
            let at = |flags: [bool; 2]| flags.get(end).copied().unwrap_or_default();
            let emergencies = (SOFTWARE.get(end).copied(), SWITCH.get(end).copied());
            let (Some(software), Some(switch)) = emergencies else { continue };
            plant.report(software, at(outside));
            let touches = at(closed) && (heads || at(self.touched));
            plant.report(switch, touches);
            if let Some(touched) = self.touched.get_mut(end) {
                *touched = touches;
            }
        }
    }

    /// Notes a stall, which `lasts` until the motor is told something else.
    pub(super) const fn watch_stall(&mut self, stall: bool, lasts: bool) {
        self.stalled = (self.stalled || stall) && lasts;
    }

    /// Tells of a stall, or of its end.
    pub(super) fn report_stall<T: Circuit>(&self, plant: &mut Plant<'_, T>) {
        plant.report(Emergency::Stall, self.stalled);
    }

    /// The limit switch of an end, 0 for that of negative positions, has ended a homing.
    pub(super) fn meet_switch<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, end: usize) {
        if let (Some(touched), Some(switch)) = (self.touched.get_mut(end), SWITCH.get(end)) {
            *touched = true;
            // Also if it was closed before: it is told once more.
            plant.errors.overlook(*switch);
            plant.report(*switch, true);
        }
    }

    /// Ends the limits that were reached: there are none any more.
    pub(super) fn end<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        *self = Limits::default();
        for emergency in SOFTWARE.into_iter().chain(SWITCH).chain([Emergency::Stall]) {
            plant.report(emergency, false);
        }
    }

    /// True while the motor is at a limit switch that has stopped it, or has stalled.
    pub(super) fn are_touched(&self) -> bool {
        self.stalled || self.touched.contains(&true)
    }
}

/// True if a task leads further out of a limit that is reached.
pub(super) fn leads_out(task: Task, settings: &Settings, live: &Live) -> bool {
    let direction = task.direction(live.position);
    if direction == 0 {
        return false;
    }
    let ([low, high], [left, right]) = (outside(settings, live), closed(settings, live));
    if direction < 0 { low || left } else { high || right }
}

/// Whether the motor is beyond the software limit of each end, that of negative positions first.
#[inline(always)]
pub(super) fn outside(settings: &Settings, live: &Live) -> [bool; 2] {
    let position = i64::from(live.position);
    let [low, high] = position_limits(settings);
    // Masters write the lower one first: between the two writes there are no limits.
    if low > high { [false; 2] } else { [position < low, position > high] }
}

/// Whether the limit switch of each end that is in use is closed, that of negative positions first.
fn closed(settings: &Settings, live: &Live) -> [bool; 2] {
    let switches = settings.switches().shown(live);
    [switches & 1 != 0, switches & 2 != 0]
}

/// The software limits in microsteps, lowest first: those of 607Dh less the home offset. The least and the largest
/// number of 607Dh, its defaults, are no limits, whatever the offset is.
pub(super) fn position_limits(settings: &Settings) -> [i64; 2] {
    let number = |object| settings.of(object) as i32;
    let offset = i64::from(number(Object::HomeOffset));
    [Object::MinimumPositionLimit, Object::MaximumPositionLimit].map(|limit| match number(limit) {
        i32::MIN => i64::MIN,
        i32::MAX => i64::MAX,
        limit => i64::from(limit).saturating_sub(offset),
    })
}
