//! The modes of operation (manual chapters 6 to 8): what each asks of the motor, and when its target is reached.
//!
//! A mode asks for one [`Task`] at a time. It is told to the motor when it changes, so objects that are written again
//! with the values they have, as cyclic masters do, tell nothing.

use super::limit::{leads_out, position_limits};
use super::plant::Plant;
use super::task::Task;
use crate::canopen::errors::Emergency;
use crate::canopen::object::Object;
use crate::canopen::settings::Settings;
use crate::device::Circuit;
use crate::motion::Pace;
use crate::units::Micros;

/// The software limits, as a message names them.
const LIMITS: (u16, u8) = (0x607D, 1);

/// The value of 6067h that switches the position window off.
const NO_WINDOW: u32 = u32::MAX;

/// The modes of operation, by the numbers of 6060h.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::canopen) enum OperationMode {
    /// The motor stands.
    #[default]
    None = 0,
    /// pp: the motor goes to positions.
    ProfilePosition = 1,
    /// vl: the motor turns at 6042h.
    Velocity = 2,
    /// pv: the motor turns at 60FFh.
    ProfileVelocity = 3,
    /// hm: the motor looks for the home position.
    Homing = 6,
}

impl OperationMode {
    /// The mode with this number of 6060h.
    pub(super) const fn numbered(number: u32) -> Self {
        match number {
            1 => OperationMode::ProfilePosition,
            2 => OperationMode::Velocity,
            3 => OperationMode::ProfileVelocity,
            6 => OperationMode::Homing,
            _ => OperationMode::None,
        }
    }
}

/// The notes of the mode of operation.
#[derive(Debug, Default)]
pub(super) struct Motion {
    /// The mode in force.
    mode: OperationMode,
    /// The motor first comes to a stand, because the mode has changed.
    settling: bool,
    /// The target position that was taken last; `None` if none has been since the mode or the state has changed.
    target: Option<i32>,
    /// The target has been taken with the last edge of bit 4, which is still set.
    acknowledged: bool,
    /// The task that the motor was told last; `None` if it is to be told anew in any case.
    told: Option<Task>,
    /// A command that a limit has ended. It is told again after another one.
    dropped: Option<Task>,
    /// The target is reached.
    reached: bool,
    /// The time since when the position has been within its window.
    within: Option<Micros>,
}

impl Motion {
    pub(super) const fn mode(&self) -> OperationMode {
        self.mode
    }

    /// True while the controlword still shows the edge with which the target has been taken.
    pub(super) const fn is_acknowledged(&self) -> bool {
        self.acknowledged
    }

    /// The controlword does not show it any more.
    pub(super) const fn end_acknowledgement(&mut self) {
        self.acknowledged = false;
    }

    /// True if the target is reached.
    pub(super) const fn is_reached(&self) -> bool {
        self.reached
    }

    /// A limit has ended what the motor was told.
    pub(super) const fn drop(&mut self, task: Task) {
        self.dropped = Some(task);
    }

    /// True if a limit has ended this.
    pub(super) fn has_dropped(&self, task: Task) -> bool {
        self.dropped == Some(task)
    }

    /// Enters a mode. A motor that moves first comes to a stand.
    pub(super) fn enter(&mut self, mode: OperationMode) {
        self.forget();
        (self.mode, self.settling) = (mode, true);
    }

    /// Forgets what the motor was to do, because the state or the mode has changed: the motor stands, or is being
    /// stopped.
    pub(super) fn forget(&mut self) {
        *self = Motion { mode: self.mode, told: Some(Task::Stand), ..Motion::default() };
    }

    /// Takes 607Ah as a new target. A relative one counts from the target before, or without one from where the motor
    /// stands. A target outside the software limits is refused. So is one so far away that the motor would go there the
    /// other way round the 32 bits. In both cases the motor goes on to the target before.
    pub(super) fn take_target<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, relative: bool) {
        let position = plant.live.position;
        let base = if relative { self.target.unwrap_or(position) } else { 0 };
        let given = plant.settings.of(Object::TargetPosition) as i32;
        let target = i64::from(base).saturating_add(given.into());
        let way = target.saturating_sub(position.into());
        let [low, high] = position_limits(plant.settings);
        match i32::try_from(target) {
            _ if low > high => plant.errors.raise(Emergency::Refused, Some(LIMITS)),
            Ok(allowed) if (low..=high).contains(&target) && i32::try_from(way).is_ok() => {
                (self.target, self.told, self.dropped) = (Some(allowed), None, None);
                (self.acknowledged, self.within) = (true, None);
            }
            _ => plant.errors.raise(Emergency::Refused, None),
        }
    }

    /// The task that the mode asks for; `halts` is true at a halt.
    pub(super) fn asked(&self, settings: &Settings, halts: bool) -> Task {
        match self.mode {
            _ if halts => Task::Stand,
            OperationMode::ProfilePosition => self.target.map_or(Task::Stand, Task::Go),
            OperationMode::Velocity => Task::Turn(settings.signed_velocity(Object::TargetVelocityVl)),
            OperationMode::ProfileVelocity => Task::Turn(settings.signed_velocity(Object::TargetVelocity)),
            OperationMode::None | OperationMode::Homing => Task::Stand,
        }
    }

    /// Tells the motor what the mode asks for, if that has changed. To be called while the motor obeys the mode.
    pub(super) fn steer<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, asked: Task) {
        if self.mode == OperationMode::Homing || self.settling && !plant.stands() {
            return;
        }
        self.settling = false;
        self.dropped.take_if(|dropped| *dropped != asked);
        if leads_out(asked, plant.settings, plant.live) {
            self.dropped = Some(asked);
        }
        let task = if self.dropped.is_some() { Task::Stand } else { asked };
        if self.told != Some(task) {
            self.reached = false;
            // If a chip has not taken it, the motor is told again in the next turn.
            self.told = self.tell(plant, task).then_some(task);
        }
    }

    /// Tells the motor a task; false if a chip did not take it.
    fn tell<T: Circuit>(&self, plant: &mut Plant<'_, T>, task: Task) -> bool {
        let (now, ramp) = (plant.now, plant.settings.acceleration(self.ramp()));
        let speed = plant.settings.velocity(Object::ProfileVelocity);
        let Some(mut axis) = plant.device.axis(0) else { return false };
        let told = match task {
            Task::Stand => axis.rotate_at(now, 0, Some(ramp)),
            Task::Turn(speed) => axis.rotate_at(now, speed, Some(ramp)),
            Task::Go(target) => {
                axis.move_at(now, target, Pace { speed: Some(speed), acceleration: Some(ramp), ..Pace::default() })
            }
        };
        told.is_ok()
    }

    /// Looks whether the target is reached, once in each turn, if the mode asks for this; `operates` is true while the
    /// motor obeys it.
    pub(super) fn look_at_target<T: Circuit>(&mut self, plant: &Plant<'_, T>, asked: Task, operates: bool) {
        let within = self.is_within_window(plant);
        let since = within.then(|| self.within.unwrap_or(plant.now));
        self.within = since;
        let time = plant.settings.values.milliseconds(Object::PositionWindowTime);
        let live = &plant.live;
        self.reached = operates
            && !self.settling
            && match asked {
                _ if self.mode == OperationMode::None => false,
                Task::Stand => plant.stands(),
                Task::Turn(speed) => live.speed == speed,
                Task::Go(target) if window(plant.settings).is_none() => live.position == target && plant.stands(),
                Task::Go(_) => since.is_some_and(|since| plant.now.since(since) >= time),
            };
    }

    /// True if the actual position (6064h) is within the window around the target.
    fn is_within_window<T: Circuit>(&self, plant: &Plant<'_, T>) -> bool {
        let (Some(target), Some(window)) = (self.target, window(plant.settings)) else { return false };
        plant.live.actual_position(&plant.settings.values).wrapping_sub(target).unsigned_abs() <= window
    }

    /// The object that has the acceleration of ramps in the mode in force.
    pub(super) const fn ramp(&self) -> Object {
        match self.mode {
            OperationMode::Velocity => Object::AccelerationDeltaSpeed,
            OperationMode::Homing => Object::HomingAcceleration,
            OperationMode::None | OperationMode::ProfilePosition | OperationMode::ProfileVelocity => {
                Object::ProfileAcceleration
            }
        }
    }
}

/// The position window (6067h), in microsteps; `None` if the motor's own counter says when the target is reached.
fn window(settings: &Settings) -> Option<u32> {
    Some(settings.of(Object::PositionWindow)).filter(|window| !matches!(*window, 0 | NO_WINDOW))
}
