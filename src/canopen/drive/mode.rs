//! The modes of operation (manual chapters 6 to 8): what each asks of the motor, and when its target is reached.
//!
//! A mode asks for one [`Task`] at a time. It is told to the motor when it changes, so objects that are written again
//! with the values they have, as cyclic masters do, tell nothing.

use super::{Mode, Motion, Task};
use crate::canopen::Node;
use crate::canopen::emcy::Emergency;
use crate::canopen::object::Object;
use crate::canopen::store::Tmcm1140;
use crate::device::Board;
use crate::motion::Pace;
use crate::units::Micros;

/// Bit of the controlword: a new set-point, or the start of a homing.
const START: u16 = 1 << 4;
/// Bit of the controlword: the set-point is relative.
const RELATIVE: u16 = 1 << 6;
/// Bit of the controlword: the motor halts.
const HALT: u16 = 1 << 8;

/// The software limits, as a message names them.
const LIMITS: (u16, u8) = (0x607D, 1);

/// The value of 6067h that switches the position window off.
const NO_WINDOW: u32 = u32::MAX;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Changes the mode of operation. A motor that moves is stopped first.
    pub(in crate::canopen) fn change_mode(&mut self, number: u32) {
        let mode = Mode::numbered(number);
        if self.drive.motion.mode == mode {
            return;
        }
        if self.drive.is_operating() {
            self.abort_homing();
            self.slow_down(self.ramp());
        }
        self.forget_motion();
        self.drive.motion.mode = mode;
        self.drive.motion.settling = true;
        self.steer();
    }

    /// Takes the bits of the controlword that belong to the mode; `before` is the controlword before, with which the drive
    /// was operating or not. An edge in the word that enables operation moves nothing, however long the way there takes.
    pub(super) fn operate(&mut self, before: u16, operates: bool) {
        let word = self.drive.controlword;
        let starts = word & !before & START != 0;
        let ends = before & !word & START != 0;
        match self.drive.motion.mode {
            Mode::ProfilePosition if starts && operates && self.drive.is_operating() => {
                self.take_target(word & RELATIVE != 0)
            }
            Mode::Homing if starts => self.start_homing(operates && self.drive.is_operating()),
            Mode::Homing if ends => self.stop_homing(),
            _ => {}
        }
        if ends {
            self.drive.motion.acknowledged = false;
        }
    }

    /// Takes 607Ah as a new target. A relative one counts from the target before, or without one from where the motor
    /// stands. A target outside the software limits is refused, and so is one so far away that the motor would go there the
    /// other way round the 32 bits; then the motor goes on to the target before.
    fn take_target(&mut self, relative: bool) {
        let base = if relative { self.drive.motion.target.unwrap_or(self.live.position) } else { 0 };
        let given = self.values.of_object(Object::TargetPosition) as i32;
        let target = i64::from(base).saturating_add(given.into());
        let way = target.saturating_sub(self.live.position.into());
        let [low, high] = self.position_limits();
        match i32::try_from(target) {
            _ if low > high => self.errors.raise(Emergency::Refused, Some(LIMITS)),
            Ok(allowed) if (low..=high).contains(&target) && i32::try_from(way).is_ok() => {
                let motion = &mut self.drive.motion;
                (motion.target, motion.told, motion.dropped) = (Some(allowed), None, None);
                (motion.acknowledged, motion.within) = (true, None);
            }
            _ => self.raise(Emergency::Refused),
        }
    }

    /// Forgets what the motor was to do, because the state or the mode has changed: the motor stands, or is being stopped.
    pub(super) fn forget_motion(&mut self) {
        let mode = self.drive.motion.mode;
        self.drive.motion = Motion { mode, told: Some(Task::Stand), ..Motion::default() };
    }

    /// Tells the motor what the mode asks for, if that has changed.
    pub(in crate::canopen) fn steer(&mut self) {
        self.steer_to(self.asked());
    }

    /// The same, if the mode asks for this.
    pub(super) fn steer_to(&mut self, asked: Task) {
        if !self.drive.is_operating() || self.drive.motion.mode == Mode::Homing {
            return;
        }
        if self.drive.motion.settling && !self.stands() {
            return;
        }
        self.drive.motion.settling = false;
        self.drive.motion.dropped.take_if(|dropped| *dropped != asked);
        if self.leads_out(asked) {
            self.drive.motion.dropped = Some(asked);
        }
        let task = if self.drive.motion.dropped.is_some() { Task::Stand } else { asked };
        if self.drive.motion.told != Some(task) {
            self.drive.motion.reached = false;
            // If a chip has not taken it, the motor is told again in the next turn.
            self.drive.motion.told = self.tell(task).then_some(task);
        }
    }

    /// What the mode asks for.
    pub(super) fn asked(&self) -> Task {
        if self.drive.controlword & HALT != 0 {
            return Task::Stand;
        }
        let velocity = |object| Task::Turn(self.scale().velocity((self.values.of_object(object) as i32).into()));
        match self.drive.motion.mode {
            Mode::ProfilePosition => self.drive.motion.target.map_or(Task::Stand, Task::Go),
            Mode::Velocity => velocity(Object::TargetVelocityVl),
            Mode::ProfileVelocity => velocity(Object::TargetVelocity),
            Mode::None | Mode::Homing => Task::Stand,
        }
    }

    /// Tells the motor a task; false if a chip did not take it.
    fn tell(&mut self, task: Task) -> bool {
        let (now, ramp) = (self.now, self.ramp());
        let speed = self.scale().velocity(self.values.of_object(Object::ProfileVelocity).into());
        let Some(mut axis) = self.device.axis(0) else { return false };
        let told = match task {
            Task::Stand => axis.rotate_at(now, 0, Some(ramp)),
            Task::Turn(speed) => axis.rotate_at(now, speed, Some(ramp)),
            Task::Go(target) => {
                axis.move_at(now, target, Pace { speed: Some(speed), acceleration: Some(ramp), ..Pace::default() })
            }
        };
        told.is_ok()
    }

    /// Looks whether the target is reached, once in each turn, if the mode asks for this.
    pub(super) fn look_at_target(&mut self, asked: Task) {
        let within = self.is_within_window();
        let since = within.then(|| self.drive.motion.within.unwrap_or(self.now));
        self.drive.motion.within = since;
        let time = Micros::from_millis(self.values.of_object(Object::PositionWindowTime).into());
        self.drive.motion.reached = self.drive.is_operating()
            && !self.drive.motion.settling
            && match asked {
                _ if self.drive.motion.mode == Mode::None => false,
                Task::Stand => self.stands(),
                Task::Turn(speed) => self.live.speed == speed,
                Task::Go(target) if self.window().is_none() => self.live.position == target && self.stands(),
                Task::Go(_) => since.is_some_and(|since| self.now.since(since) >= time),
            };
    }

    /// The position window (6067h), in microsteps; `None` if the motor's own counter says when the target is reached.
    fn window(&self) -> Option<u32> {
        Some(self.values.of_object(Object::PositionWindow)).filter(|window| !matches!(*window, 0 | NO_WINDOW))
    }

    /// True if the actual position (6064h) is within the window around the target.
    fn is_within_window(&self) -> bool {
        let (Some(target), Some(window)) = (self.drive.motion.target, self.window()) else { return false };
        self.actual_position().wrapping_sub(target).unsigned_abs() <= window
    }

    /// The acceleration of ramps in the mode in force, in internal units.
    pub(super) fn ramp(&self) -> i32 {
        self.acceleration(match self.drive.motion.mode {
            Mode::Velocity => Object::AccelerationDeltaSpeed,
            Mode::Homing => Object::HomingAcceleration,
            Mode::None | Mode::ProfilePosition | Mode::ProfileVelocity => Object::ProfileAcceleration,
        })
    }

    /// The acceleration of the quick stop ramp, in internal units.
    pub(super) fn quick_ramp(&self) -> i32 {
        self.acceleration(Object::QuickStopDeceleration)
    }

    fn acceleration(&self, object: Object) -> i32 {
        self.scale().acceleration(self.values.of_object(object))
    }

    /// True if the motor stands and is to stand, as its counter has been read. In a homing it is to go on.
    pub(super) fn stands(&self) -> bool {
        self.device.axes().iter().all(|axis| axis.rests() && !axis.searches())
    }

    /// Slows the motor down to a stand, with this acceleration; one that stands is not told.
    pub(super) fn slow_down(&mut self, acceleration: i32) {
        if self.stands() {
            return;
        }
        let now = self.now;
        let Some(mut axis) = self.device.axis(0) else { return };
        if axis.rotate_at(now, 0, Some(acceleration)).is_err() {
            // The axis tries this again until its chips take it.
            let _ = axis.hard_stop();
        }
    }

    /// Stops the motor without a ramp.
    pub(in crate::canopen) fn stop_hard(&mut self) {
        if let Some(mut axis) = self.device.axis(0) {
            // The axis tries this again until its chips take it.
            let _ = axis.hard_stop();
        }
    }
}
