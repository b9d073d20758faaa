//! An axis together with its motion controller: how it reaches its chips, what it asks them, and how it tells its
//! driver the current. What an axis does stands in the files that use this one: first `moves.rs`, then `guard.rs` and
//! `searching.rs`, which use the moves, then `turn.rs` and `parameters.rs`.

use super::Error;
use super::axis::{Axis, profile};
use super::current::MotionState;
use super::hardware::{Hardware, RampGenerator, Readings, StopSwitches};
use super::profile::Profile;
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
    pub(super) axis: &'a mut Axis<H>,
    pub(super) controller: &'a mut H::Controller,
}

impl<H: Hardware> Joined<'_, H> {
    /// The state of the axis, to look at.
    pub fn state(&self) -> &Axis<H> {
        self.axis
    }

    /// The state of the axis, to change what the chips are not told of.
    pub fn state_mut(&mut self) -> &mut Axis<H> {
        self.axis
    }

    /// The chips of the axis.
    pub(super) fn chips(&mut self) -> H::Bound<'_> {
        self.axis.hardware.bind(self.controller)
    }

    /// The chips of the axis, and the profile of its motion. Always inlined, because otherwise both are returned in
    /// memory and copied from there, which takes 50 cycles of each command.
    #[inline(always)]
    pub(super) fn chips_and_profile(&mut self) -> (H::Bound<'_>, Profile<'_>) {
        let Axis { hardware, values, search, orders, watched, .. } = &mut *self.axis;
        let mut profile = profile(values, search.as_ref(), &orders.pace);
        profile.stops.right &= watched.is_none();
        (hardware.bind(self.controller), profile)
    }

    /// The last readings of the chips.
    pub fn readings(&self) -> Readings {
        self.axis.hardware.readings(self.controller)
    }

    /// Gives the motor the current that belongs to this state of motion; a driver that has it already is not written
    /// to.
    pub(super) fn refresh_excitation(&mut self, now: Micros, state: MotionState) -> Result<(), Error> {
        let excitation = self.axis.select_excitation(now, state);
        let Axis { hardware, values, driving, .. } = &mut *self.axis;
        let waits = hardware.readings(self.controller).waits;
        driving.refresh(&mut hardware.bind(self.controller), values, excitation, waits)
    }

    /// Writes the driver's parameters and the present excitation to the driver.
    pub(super) fn write_driver(&mut self) -> Result<(), Error> {
        let Axis { hardware, values, driving, .. } = &mut *self.axis;
        driving.write(&mut hardware.bind(self.controller), values)
    }

    /// Ends a shut-down of the driver before a motion.
    pub(super) fn release_driver(&mut self) -> Result<(), Error> {
        let Axis { hardware, values, orders, driving, measured, .. } = &mut *self.axis;
        driving.release(&mut hardware.bind(self.controller), values, &mut orders.alarms, measured)
    }

    /// Looks for a stall of the motor, as in [`Measured::stalls`](super::stall::Measured::stalls).
    pub(super) fn look_for_stall(&mut self) -> Result<bool, Error> {
        let Axis { hardware, values, measured, sensors, .. } = &mut *self.axis;
        let known = *hardware.known();
        measured.stalls(&mut hardware.bind(self.controller), known, values, sensors.stall)
    }

    /// Reads the actual position in microsteps from the hardware.
    ///
    /// # Errors
    /// [`Error::Chip`] when the chip did not answer.
    pub fn actual_position(&mut self) -> Result<i32, Error> {
        self.chips().position()
    }

    /// Reads the speed to which the motor is accelerating or braking: the commanded one, also while the motor brakes at
    /// a stop switch, or the ramp generator's own.
    pub(super) fn target_speed(&mut self) -> Result<i32, Error> {
        if let Some(told) = self.axis.orders.ended.filter(|_| self.axis.last_speed() != 0) {
            return Ok(told);
        }
        self.chips().target_speed()
    }

    /// Reads the actual speed from the hardware, right if positive.
    pub(super) fn actual_speed(&mut self) -> Result<i32, Error> {
        self.chips().speed()
    }

    /// Reads the stop switches from the hardware; the home switch is that of this poll.
    pub(super) fn switches(&mut self) -> Result<Switches, Error> {
        let stops = self.chips().switches()?;
        Ok(self.with_home(stops))
    }

    /// The stop switches in this turn; the home switch is that of this poll.
    pub(super) fn turn_switches(&mut self) -> Result<Switches, Error> {
        let stops = self.chips().turn_switches()?;
        Ok(self.with_home(stops))
    }

    fn with_home(&self, [left, right]: [bool; 2]) -> Switches {
        let right = self.axis.watched_right().unwrap_or(right);
        Switches { left, right, home: self.axis.sensors.home }
    }
}
