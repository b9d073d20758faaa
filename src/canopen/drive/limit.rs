//! What keeps the motor within its limits: software limits (manual section 6.1.11), limit switches, and stop on stall
//! (section 4.2.31). Each stops the motor, sends an emergency message and shows in bit 11 of the statusword; the drive
//! stays in OPERATION ENABLED, and commands that lead back are obeyed.
//!
//! The motion controller itself, or for a switch that it does not watch the axis, stops the motor at a limit switch. A
//! software limit stops it along the ramp, so the
//! motor runs past the limit by the way of that ramp, and of the millisecond in which the limit was noticed.

use super::{Limits, Task};
use crate::canopen::Node;
use crate::canopen::emcy::Emergency;
use crate::canopen::object::Object;
use crate::canopen::store::Tmcm1140;
use crate::device::Board;
use crate::motion::Events;

/// The emergencies of the two ends, that of negative positions first.
const SOFTWARE: [Emergency; 2] = [Emergency::NegativeSoftwareLimit, Emergency::PositiveSoftwareLimit];
const SWITCH: [Emergency; 2] = [Emergency::NegativeLimitSwitch, Emergency::PositiveLimitSwitch];

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Looks at the limits, once in each turn.
    pub(super) fn look_at_limits(&mut self, events: Events) {
        if self.drive.homing.running {
            // A search runs to the switches, and positions have no meaning before its end.
            self.drive.limits = Limits::default();
        } else {
            self.watch_limits(events);
        }
        self.report(Emergency::Stall, self.drive.limits.stalled);
    }

    fn watch_limits(&mut self, events: Events) {
        let asked = if self.drive.is_operating() { self.asked() } else { Task::Stand };
        let towards = [self.live.speed, self.direction(asked)];
        let (outside, closed) = (self.outside(), self.closed());
        let heads = [towards.into_iter().any(i32::is_negative), towards.into_iter().any(i32::is_positive)];
        for (end, heads) in heads.into_iter().enumerate() {
            let at = |flags: [bool; 2]| flags.get(end).copied().unwrap_or_default();
            let emergencies = (SOFTWARE.get(end).copied(), SWITCH.get(end).copied());
            let (Some(software), Some(switch)) = emergencies else { continue };
            self.report(software, at(outside));
            let touches = at(closed) && (heads || at(self.drive.limits.touched));
            self.report(switch, touches);
            if let Some(touched) = self.drive.limits.touched.get_mut(end) {
                *touched = touches;
            }
        }
        if events.stall {
            self.drive.limits.stalled = true;
            self.drive.motion.dropped = Some(asked);
        }
        self.drive.limits.stalled &= self.drive.motion.dropped == Some(asked);
    }

    /// The limit switch of an end, 0 for that of negative positions, has ended a homing.
    pub(super) fn meet_limit_switch(&mut self, end: usize) {
        if let (Some(touched), Some(switch)) = (self.drive.limits.touched.get_mut(end), SWITCH.get(end)) {
            *touched = true;
            // Also if it was closed before: it is told once more.
            self.errors.note(*switch, false);
            self.report(*switch, true);
        }
    }

    /// True while a limit is active.
    pub(super) fn is_limited(&self) -> bool {
        let Limits { touched, stalled } = self.drive.limits;
        // In TMCL mode, and while a homing is under way, there are no software limits.
        let outside = !self.tunnel.in_tmcl_mode() && !self.drive.homing.running && self.outside().contains(&true);
        stalled || touched.contains(&true) || outside
    }

    /// True if a task leads further out of a limit that is reached.
    pub(super) fn leads_out(&self, task: Task) -> bool {
        let direction = self.direction(task);
        if direction == 0 {
            return false;
        }
        let ([low, high], [left, right]) = (self.outside(), self.closed());
        if direction < 0 { low || left } else { high || right }
    }

    /// The direction in which a task leads from here, as a sign.
    fn direction(&self, task: Task) -> i32 {
        match task {
            Task::Stand => 0,
            Task::Turn(speed) => speed.signum(),
            Task::Go(target) => target.cmp(&self.live.position) as i32,
        }
    }

    /// Whether the motor is beyond the software limit of each end, that of negative positions first.
    fn outside(&self) -> [bool; 2] {
        let position = i64::from(self.live.position);
        let [low, high] = self.position_limits();
        // Masters write the lower one first: between the two writes there are no limits.
        if low > high { [false; 2] } else { [position < low, position > high] }
    }

    /// Whether the limit switch of each end that is in use is closed, that of negative positions first.
    fn closed(&self) -> [bool; 2] {
        let switches = self.switches();
        [switches & 1 != 0, switches & 2 != 0]
    }

    /// The software limits in microsteps, lowest first: those of 607Dh less the home offset. The least and the largest
    /// number of 607Dh, its defaults, are no limits, whatever the offset is.
    pub(super) fn position_limits(&self) -> [i64; 2] {
        let number = |object| self.values.of_object(object) as i32;
        let offset = i64::from(number(Object::HomeOffset));
        [Object::MinimumPositionLimit, Object::MaximumPositionLimit].map(|limit| match number(limit) {
            i32::MIN => i64::MIN,
            i32::MAX => i64::MAX,
            limit => i64::from(limit).saturating_sub(offset),
        })
    }
}
