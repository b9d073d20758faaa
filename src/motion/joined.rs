//! An axis together with its motion controller: how it reaches its chips, what it asks them, and how it tells its
//! driver the current. What an axis does stands in the files that use this one: first `moves.rs`, then `guard.rs` and
//! `searching.rs`, which use the moves, then `turn.rs` and `parameters.rs`.

use core::ops::{Deref, DerefMut};

use super::Error;
use super::axis::{Axis, course};
use super::current::MotionState;
use super::hardware::{Course, Hardware};
use super::switch::Switches;
use crate::units::Micros;

impl<H: Hardware> Axis<H> {
    /// Joins the axis with its motion controller.
    pub fn on<'a>(&'a mut self, controller: &'a mut H::Controller) -> Joined<'a, H> {
        Joined { axis: self, controller }
    }
}

/// An axis together with its motion controller, and so with the way to its chips.
#[derive(Debug)]
pub struct Joined<'a, H: Hardware> {
    axis: &'a mut Axis<H>,
    controller: &'a mut H::Controller,
}

impl<H: Hardware> Deref for Joined<'_, H> {
    type Target = Axis<H>;

    fn deref(&self) -> &Axis<H> {
        self.axis
    }
}

impl<H: Hardware> DerefMut for Joined<'_, H> {
    fn deref_mut(&mut self) -> &mut Axis<H> {
        self.axis
    }
}

impl<'a, H: Hardware> Joined<'a, H> {
    /// The hardware of the axis, and the motion controller that each function of the hardware needs.
    pub(super) fn reach(&mut self) -> (&mut H, &mut H::Controller) {
        (&mut self.axis.hardware, self.controller)
    }

    /// The axis and its motion controller, each by itself, for a value of the axis that is lent others of its values.
    pub(super) fn parts(&mut self) -> (&mut Axis<H>, &mut H::Controller) {
        (self.axis, self.controller)
    }

    /// Calls a function of the hardware with the motion controller and with the course that the motor is to take.
    pub(super) fn on_course<R>(&mut self, act: impl FnOnce(&mut H, &mut H::Controller, &Course<'_>) -> R) -> R {
        let Axis { hardware, values, search, orders, watched, .. } = &mut *self.axis;
        let mut course = course(values, search.as_ref(), &orders.pace);
        course.stops.right &= watched.is_none();
        act(hardware, self.controller, &course)
    }

    /// True if the hardware has lost its registers, as in [`Hardware::is_lost`].
    pub fn is_lost(&self) -> bool {
        self.hardware.is_lost(self.controller)
    }

    /// The motion controller of the axis, with its last readings.
    pub(super) fn controller(&self) -> &H::Controller {
        self.controller
    }

    /// The driver's flags as read last, as the bits of parameter 208.
    pub fn last_flags(&self) -> u32 {
        self.hardware.flags(self.controller())
    }

    /// Gives the motor the current that belongs to this state of motion; a driver that has it already is not written
    /// to.
    pub(super) fn refresh_excitation(&mut self, now: Micros, state: MotionState) -> Result<(), Error> {
        let excitation = self.select_excitation(now, state);
        let (Axis { hardware, values, driving, .. }, controller) = self.parts();
        driving.refresh(hardware, controller, values, excitation)
    }

    /// Writes the driver's parameters and the present excitation to the driver.
    pub(super) fn write_driver(&mut self) -> Result<(), Error> {
        let (Axis { hardware, values, driving, .. }, controller) = self.parts();
        driving.write(hardware, controller, values)
    }

    /// Reads the actual position in microsteps from the hardware.
    ///
    /// # Errors
    /// [`Error::Chip`] when the chip did not answer.
    pub fn actual_position(&mut self) -> Result<i32, Error> {
        let (hardware, controller) = self.reach();
        hardware.position(controller)
    }

    /// Reads the speed to which the motor is accelerating or braking: the commanded one, also while the motor brakes at
    /// a stop switch, or the ramp generator's own.
    pub(super) fn target_speed(&mut self) -> Result<i32, Error> {
        if let Some(told) = self.orders.ended.filter(|_| self.last_speed() != 0) {
            return Ok(told);
        }
        let (hardware, controller) = self.reach();
        hardware.target_speed(controller)
    }

    /// Reads the actual speed from the hardware, right if positive.
    pub(super) fn actual_speed(&mut self) -> Result<i32, Error> {
        let (hardware, controller) = self.reach();
        hardware.speed(controller)
    }

    /// Reads the stop switches from the hardware; the home switch is that of this poll.
    pub(super) fn switches(&mut self) -> Result<Switches, Error> {
        let (hardware, controller) = self.reach();
        let stops = hardware.switches(controller)?;
        Ok(self.with_home(stops))
    }

    /// The stop switches in this turn; the home switch is that of this poll.
    pub(super) fn turn_switches(&mut self) -> Result<Switches, Error> {
        let (hardware, controller) = self.reach();
        let stops = hardware.turn_switches(controller)?;
        Ok(self.with_home(stops))
    }

    fn with_home(&self, [left, right]: [bool; 2]) -> Switches {
        Switches { left, right: self.watched_right().unwrap_or(right), home: self.sensors.home }
    }
}
