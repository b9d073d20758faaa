//! The settings of a node, with what the motion controller makes of velocities and accelerations by them. Here is also
//! how they reach the axis and the outputs, at the start and when they are written.

use super::cia301::abort::Abort;
use super::drive::unit::{Scale, admit_ramp};
use super::entry::Entry;
use super::object::{Object, ROWS, Row, Writing};
use super::row::Form;
use super::switches::Switches;
use super::values::Values;
use crate::device::{Circuit, Device};
use crate::motion::Error;
use crate::param::AxisParameter as P;
use crate::units::{Internal, Micros};

/// The general purpose pins stand from this bit on in 2702h, 2703h and 60FDh.
pub(super) const PINS: u32 = 16;
/// The outputs OUT0 and OUT1.
const OUTPUTS: u8 = 0b11;
/// The output of the brake, OUT0.
const BRAKE: u8 = 0b01;
/// From this current on (200Ch, in 1/255) OUT0, which can only be on or off, is on.
const ON: u32 = 128;

/// The lowest end of the hysteresis.
const HYSTERESIS_END: i32 = -3;

impl Form {
    /// The value of the axis parameter.
    fn parameter(self, value: u32, scale: &Scale) -> i32 {
        match self {
            Form::Same => value as i32,
            Form::HysteresisEnd => (value as i32).saturating_sub(HYSTERESIS_END),
            Form::Threshold => scale.threshold(value),
        }
    }
}

/// The settings.
#[derive(Debug)]
pub(super) struct Settings {
    pub(super) values: Values,
    /// The scale of velocities and accelerations in the motion controller, by the values.
    pub(super) scale: Scale,
}

impl Settings {
    /// The defaults.
    pub(super) fn new() -> Self {
        Settings { values: Values::of(1), scale: Scale::START }
    }

    /// The value of an object that is a setting.
    pub(super) fn of(&self, object: Object) -> u32 {
        self.values.of_object(object)
    }

    /// The time at which a delay is over that begins now.
    pub(super) fn after(&self, now: Micros, delay: Object) -> Micros {
        now.after(self.values.milliseconds(delay))
    }

    /// A velocity as the motion controller has it.
    #[inline(always)]
    pub(super) fn velocity(&self, object: Object) -> Internal {
        self.scale.velocity(self.of(object).into())
    }

    /// A velocity whose object is signed, as the motion controller has it.
    #[inline(always)]
    pub(super) fn signed_velocity(&self, object: Object) -> Internal {
        self.scale.velocity((self.of(object) as i32).into())
    }

    /// An acceleration as the motion controller has it.
    #[inline(always)]
    pub(super) fn acceleration(&self, object: Object) -> Internal {
        self.scale.acceleration(self.of(object))
    }

    /// The settings of the switches (2005h).
    pub(super) fn switches(&self) -> Switches {
        Switches::of(self.of(Object::LimitSwitches))
    }

    /// Gives the axis the restored values, before the start of the device writes them to the chips.
    pub(super) fn preset<T: Circuit>(&mut self, device: &mut Device<T, 1>) {
        self.scale = Scale::of(&self.values);
        let Some(mut axis) = device.axis(0) else { return };
        for (object, row) in Object::ALL.iter().zip(&ROWS) {
            if let Some((parameter, form)) = linked(row) {
                axis.state_mut().preset_setting(parameter, form.parameter(self.of(*object), &self.scale));
            }
        }
        let (ramp, pulse) = self.scale.divisors();
        axis.state_mut().preset_setting(P::RampDivisor, ramp.into());
        axis.state_mut().preset_setting(P::PulseDivisor, pulse.into());
    }

    /// Tells the axis how many microsteps a turn of the motor has, from which the position of the encoder follows.
    pub(super) fn tell_turn<T: Circuit>(&self, device: &mut Device<T, 1>) {
        if let Some(mut axis) = device.axis(0) {
            axis.state_mut().set_turn(self.scale.turn() as i32);
        }
    }

    /// Writes an object that is an axis parameter.
    ///
    /// # Errors
    /// The chips cannot be told, and nothing has changed.
    pub(super) fn write_parameter<T: Circuit>(
        &mut self,
        now: Micros,
        device: &mut Device<T, 1>,
        entry: Entry,
        value: u32,
    ) -> Result<(), Abort> {
        self.tell_parameter(now, device, entry.object, value)?;
        self.values.set(entry, value);
        Ok(())
    }

    fn tell_parameter<T: Circuit>(
        &self,
        now: Micros,
        device: &mut Device<T, 1>,
        object: Object,
        value: u32,
    ) -> Result<(), Abort> {
        let Some((parameter, form)) = linked(Entry::of(object).row()) else { return Ok(()) };
        let Some(mut axis) = device.axis(0) else { return Ok(()) };
        axis.set(now, parameter, form.parameter(value, &self.scale)).map_err(abort)
    }

    /// Writes one of the objects on which the divisors depend. While the bridges may be on, the divisors have to stay:
    /// so the microsteps in a turn, on which rpm depend, are changed only while the drive `is_disabled`.
    ///
    /// # Errors
    /// The drive is in another state, or the motion controller could go to no position, or the chips cannot be told;
    /// nothing has changed.
    pub(super) fn write_scaled<T: Circuit>(
        &mut self,
        now: Micros,
        device: &mut Device<T, 1>,
        is_disabled: bool,
        entry: Entry,
        value: u32,
    ) -> Result<(), Abort> {
        let divisor = |object| if object == entry.object { value } else { self.of(object) } as u8;
        let admitted = || admit_ramp(divisor(Object::RampDivisor), divisor(Object::PulseDivisor));
        match entry.object {
            Object::RampDivisor | Object::PulseDivisor if !admitted() => return Err(Abort::Value),
            Object::FullStepResolution | Object::MicrostepResolution if self.scale.is_of_turns() && !is_disabled => {
                return Err(Abort::State);
            }
            _ => {}
        }
        self.tell_parameter(now, device, entry.object, value)?;
        self.rescale(now, device, [(entry, value)])?;
        self.tell_turn(device);
        Ok(())
    }

    /// Writes the largest velocity or acceleration, of which this is the largest that there is, and which is fixed in
    /// internal units.
    ///
    /// # Errors
    /// As [`Settings::write_scaled`].
    pub(super) fn write_largest<T: Circuit>(
        &mut self,
        now: Micros,
        device: &mut Device<T, 1>,
        entry: Entry,
        value: u32,
        largest: u32,
    ) -> Result<(), Abort> {
        if self.scale.is_internal() && value != largest {
            return Err(Abort::Value);
        }
        if value > largest {
            return Err(Abort::TooHigh);
        }
        self.rescale(now, device, [(entry, value)])
    }

    /// Changes the unit of velocities (208Ch): the largest velocity and acceleration become those of the new one.
    ///
    /// # Errors
    /// The chips cannot be told, and nothing has changed.
    pub(super) fn write_dimension<T: Circuit>(
        &mut self,
        now: Micros,
        device: &mut Device<T, 1>,
        entry: Entry,
        value: u32,
    ) -> Result<(), Abort> {
        if self.values.get(entry) == value {
            return Ok(());
        }
        let scale = self.scale.in_dimension(value);
        let largest = [
            (entry, value),
            (Entry::of(Object::MaximumVelocity), scale.largest_velocity()),
            (Entry::of(Object::MaximumAcceleration), scale.largest_acceleration()),
        ];
        self.rescale(now, device, largest)
    }

    /// Changes objects, and takes over the scale that follows from them. Objects from which other divisors follow are
    /// written in SWITCH ON DISABLED alone, where the motor stands.
    fn rescale<T: Circuit, const N: usize>(
        &mut self,
        now: Micros,
        device: &mut Device<T, 1>,
        changes: [(Entry, u32); N],
    ) -> Result<(), Abort> {
        let before = changes.map(|(entry, _)| (entry, self.values.get(entry)));
        self.values.set_all(changes);
        let old = core::mem::replace(&mut self.scale, Scale::of(&self.values));
        self.tell_scale(now, device, old.divisors()).inspect_err(|_| {
            self.values.set_all(before);
            self.scale = old;
        })
    }

    /// Tells the axis what depends on the scale. It has these divisors.
    fn tell_scale<T: Circuit>(&self, now: Micros, device: &mut Device<T, 1>, known: (u8, u8)) -> Result<(), Abort> {
        let (ramp, pulse) = self.scale.divisors();
        if let Some(mut axis) = device.axis(0).filter(|_| (ramp, pulse) != known) {
            axis.set_divisors(ramp.into(), pulse.into()).map_err(abort)?;
        }
        for object in [Object::StopOnStall, Object::SmartEnergyThresholdSpeed] {
            self.tell_parameter(now, device, object, self.of(object))?;
        }
        Ok(())
    }

    /// Sets the outputs that the mask lets be switched, and the brake at OUT0, `released` or applied, if there is one.
    pub(super) fn switch_outputs<T: Circuit>(&self, device: &mut Device<T, 1>, released: bool) {
        let pins = |object| (self.of(object) >> PINS) as u8;
        let (mut mask, mut wanted) = (pins(Object::OutputMask) & OUTPUTS, pins(Object::PhysicalOutputs));
        if let Some(on) = self.brake(released) {
            (mask, wanted) = (mask | BRAKE, wanted & !BRAKE | if on { BRAKE } else { 0 });
        }
        let outputs = device.outputs_mut();
        outputs.digital = outputs.digital & !mask | wanted & mask;
    }

    /// The level of OUT0 as the brake needs it; `None` if there is no automatic brake, because both currents are 0.
    fn brake(&self, released: bool) -> Option<bool> {
        let (apply, release) = (self.of(Object::BrakeApplyCurrent), self.of(Object::BrakeReleaseCurrent));
        let current = if released { release } else { apply };
        (apply != 0 || release != 0).then_some(current >= ON)
    }

    /// Switches the pull-up resistors.
    pub(super) fn switch_pull_ups<T: Circuit>(&self, device: &mut Device<T, 1>) {
        device.outputs_mut().pull_ups = (self.of(Object::PullUps) != 0).into();
    }
}

/// The axis parameter that the object of a row is, and how.
const fn linked(row: &Row) -> Option<(P, Form)> {
    match row.writing {
        Writing::Axis(parameter, form) => Some((parameter, form)),
        Writing::Scaled(Some(parameter)) => Some((parameter, Form::Same)),
        Writing::Scaled(None) | Writing::Plain | Writing::Record(..) | Writing::Special(_) => None,
    }
}

/// Why a parameter is not written. Its value was in range, so it is the chips that have not taken it.
fn abort(error: Error) -> Abort {
    match error {
        Error::ReadOnly | Error::OutOfRange | Error::NotNow => Abort::Value,
        Error::Chip => Abort::Hardware,
    }
}
