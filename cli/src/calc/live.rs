//! The settings of a module that is at hand, on which the meaning of its numbers depends.

use tmcl_tools::calc::Settings;
use tmcl_tools::conversation::{Conversation, Error};
use tmcl_tools::product::axis_number;
use tmcm::param::AxisParameter as P;

/// Asks a module for the settings of an axis, whose motor has so many full steps per turn.
pub(crate) fn settings(module: &mut Conversation, axis: u8, steps: u16) -> Result<Settings, Error> {
    let product = module.product()?;
    let in_chip = module.is_in_chip_units(axis)?;
    let mut known = |parameter, otherwise| match axis_number(product, parameter) {
        Some(_) => module.axis(axis, parameter),
        None => Ok(otherwise),
    };
    let divisor = |number: i32| u8::try_from(number).unwrap_or_default();
    let divisors = (divisor(known(P::PulseDivisor, 0)?), divisor(known(P::RampDivisor, 0)?));
    let microsteps = 1 << known(P::MicrostepResolution, 8)?.clamp(0, 8);
    Ok(Settings { divisors, microsteps, steps, in_chip })
}
