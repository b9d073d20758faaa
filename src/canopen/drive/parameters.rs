//! The objects that are parameters of the axis, and those on which the divisors of the motion controller depend: how
//! their values reach the axis, at the start and when they are written.

use super::unit::{Scale, admit_ramp};
use crate::canopen::Node;
use crate::canopen::abort::Abort;
use crate::canopen::object::{Entry, Object};
use crate::canopen::store::Tmcm1140;
use crate::canopen::values::Values;
use crate::device::Board;
use crate::motion::Error;
use crate::param::AxisParameter as P;

/// How the value of an object becomes that of an axis parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// As it is.
    Same,
    /// The end of the hysteresis: the object is signed, the chip's field begins at -3.
    HysteresisEnd,
    /// A velocity in the unit of 208Ch from which on something acts.
    Threshold,
}

/// The objects that are axis parameters.
const LINKS: [(Object, P, Form); 21] = [
    (Object::MicrostepResolution, P::MicrostepResolution, Form::Same),
    (Object::MaximumCurrent, P::MaximumCurrent, Form::Same),
    (Object::StandbyCurrent, P::StandbyCurrent, Form::Same),
    (Object::StandbyDelay, P::PowerDownDelay, Form::Same),
    (Object::ChopperBlankTime, P::ChopperBlankTime, Form::Same),
    (Object::ChopperMode, P::ConstantToffMode, Form::Same),
    (Object::ChopperHysteresisDecrement, P::ChopperHysteresisDecrement, Form::Same),
    (Object::ChopperHysteresisEnd, P::ChopperHysteresisEnd, Form::HysteresisEnd),
    (Object::ChopperHysteresisStart, P::ChopperHysteresisStart, Form::Same),
    (Object::ChopperOffTime, P::ChopperOffTime, Form::Same),
    (Object::SmartEnergyCurrentMinimum, P::SmartEnergyCurrentMinimum, Form::Same),
    (Object::SmartEnergyDownStep, P::SmartEnergyDownStep, Form::Same),
    (Object::SmartEnergyHysteresis, P::SmartEnergyHysteresis, Form::Same),
    (Object::SmartEnergyUpStep, P::SmartEnergyUpStep, Form::Same),
    (Object::SmartEnergyHysteresisStart, P::SmartEnergyHysteresisStart, Form::Same),
    (Object::StallGuardFilter, P::StallGuardFilter, Form::Same),
    (Object::StallGuardThreshold, P::StallGuardThreshold, Form::Same),
    (Object::ShortProtectionDisable, P::ShortProtectionDisable, Form::Same),
    (Object::StopOnStall, P::StopOnStall, Form::Threshold),
    (Object::SmartEnergyThresholdSpeed, P::SmartEnergyThresholdSpeed, Form::Threshold),
    (Object::SmartEnergySlowRunCurrent, P::SmartEnergySlowRunCurrent, Form::Same),
];

/// The lowest end of the hysteresis.
const HYSTERESIS_END: i32 = -3;

impl Form {
    fn parameter(self, value: u32, scale: &Scale) -> i32 {
        match self {
            Form::Same => value as i32,
            Form::HysteresisEnd => (value as i32).saturating_sub(HYSTERESIS_END),
            Form::Threshold => scale.threshold(value),
        }
    }
}

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Gives the axis the restored values, before the start of the device writes them to the chips.
    pub(in crate::canopen) fn preset_parameters(&mut self) {
        self.scale = Scale::of(&self.values);
        let Some(mut axis) = self.device.axis(0) else { return };
        for (object, parameter, form) in LINKS {
            axis.preset_setting(parameter, form.parameter(self.values.of_object(object), &self.scale));
        }
        let (ramp, pulse) = self.scale.divisors();
        axis.preset_setting(P::RampDivisor, ramp.into());
        axis.preset_setting(P::PulseDivisor, pulse.into());
    }

    /// Writes an object that is an axis parameter.
    ///
    /// # Errors
    /// The chips cannot be told, and nothing has changed.
    pub(in crate::canopen) fn write_parameter(&mut self, entry: Entry, value: u32) -> Result<(), Abort> {
        self.tell_parameter(entry.object, value)?;
        self.values.set(entry, value);
        Ok(())
    }

    fn tell_parameter(&mut self, object: Object, value: u32) -> Result<(), Abort> {
        let Some((_, parameter, form)) = LINKS.iter().find(|(linked, ..)| *linked == object) else { return Ok(()) };
        let Some(mut axis) = self.device.axis(0) else { return Ok(()) };
        axis.set(self.now, *parameter, form.parameter(value, &self.scale)).map_err(abort)
    }

    /// Writes one of the objects on which the divisors depend. While the bridges may be on, the divisors have to stay: so
    /// the microsteps in a turn, on which rpm depend, are not changed then.
    ///
    /// # Errors
    /// The drive is in another state, or the motion controller could go to no position, or the chips cannot be told;
    /// nothing has changed.
    pub(in crate::canopen) fn write_scaled(&mut self, entry: Entry, value: u32) -> Result<(), Abort> {
        let divisor = |object| if object == entry.object { value } else { self.values.of_object(object) } as u8;
        let admitted = || admit_ramp(divisor(Object::RampDivisor), divisor(Object::PulseDivisor));
        match entry.object {
            Object::RampDivisor | Object::PulseDivisor if !admitted() => return Err(Abort::Value),
            Object::FullStepResolution | Object::MicrostepResolution
                if self.scale.is_of_turns() && !self.is_disabled() =>
            {
                return Err(Abort::State);
            }
            _ => {}
        }
        self.tell_parameter(entry.object, value)?;
        self.rescale([(entry, value)])
    }

    /// Changes the unit of velocities (208Ch): the largest velocity and acceleration become those of the new one.
    ///
    /// # Errors
    /// The chips cannot be told, and nothing has changed.
    pub(in crate::canopen) fn write_dimension(&mut self, entry: Entry, value: u32) -> Result<(), Abort> {
        if self.values.get(entry) == value {
            return Ok(());
        }
        let scale = self.scale.in_dimension(value);
        self.rescale([
            (entry, value),
            (Entry::of(Object::MaximumVelocity), scale.largest_velocity()),
            (Entry::of(Object::MaximumAcceleration), scale.largest_acceleration()),
        ])
    }

    /// Changes objects, and takes over the scale that follows from them. Objects from which other divisors follow are written
    /// in SWITCH ON DISABLED alone, where the motor stands.
    fn rescale<const N: usize>(&mut self, changes: [(Entry, u32); N]) -> Result<(), Abort> {
        let before = changes.map(|(entry, _)| (entry, self.values.get(entry)));
        set_all(&mut self.values, changes);
        let old = core::mem::replace(&mut self.scale, Scale::of(&self.values));
        self.tell_scale(old.divisors()).inspect_err(|_| {
            set_all(&mut self.values, before);
            self.scale = old;
        })
    }

    /// Tells the axis what depends on the scale. It has these divisors.
    fn tell_scale(&mut self, known: (u8, u8)) -> Result<(), Abort> {
        let (ramp, pulse) = self.scale.divisors();
        if let Some(mut axis) = self.device.axis(0).filter(|_| (ramp, pulse) != known) {
            axis.set_divisors(ramp.into(), pulse.into()).map_err(abort)?;
        }
        for object in [Object::StopOnStall, Object::SmartEnergyThresholdSpeed] {
            self.tell_parameter(object, self.values.of_object(object))?;
        }
        Ok(())
    }
}

fn set_all<const N: usize>(values: &mut Values, changes: [(Entry, u32); N]) {
    for (entry, value) in changes {
        values.set(entry, value);
    }
}

/// Why a parameter is not written. Its value was in range, so it is the chips that have not taken it.
fn abort(error: Error) -> Abort {
    match error {
        Error::ReadOnly | Error::OutOfRange | Error::NotNow => Abort::Value,
        Error::Chip => Abort::Hardware,
    }
}
