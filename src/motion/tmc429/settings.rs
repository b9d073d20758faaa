//! The settings of a ramp generator of the TMC429, as the profile of its motor makes them.

use crate::motion::hardware::RampMode;
use crate::motion::profile::Profile;
use crate::motion::switch::Stops;
use crate::motion::values::Values;
use crate::param::AxisParameter as P;
use crate::units::INTERNAL_MAX;

/// The settings of a ramp generator, in the chip's units. As a rule the next move has the same settings; then none of
/// their registers has to be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Settings {
    pub(super) basis: Basis,
    pub(super) mode: RampMode,
    pub(super) stops: Stops,
    /// V_MAX in internal velocity, 0..=2047.
    pub(super) speed: i32,
    /// A_MAX as wanted, in internal acceleration, 0..=2047; for positioning the chip may get a larger one.
    pub(super) acceleration: i32,
}

/// The settings that do not depend on the ramp mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Basis {
    pub(super) minimum_speed: i32,
    pub(super) ramp_div: u8,
    pub(super) pulse_div: u8,
    pub(super) tolerance: i32,
}

impl Settings {
    pub(super) fn of(mode: RampMode, profile: &Profile<'_>) -> Self {
        let Profile { values, speed, acceleration, tolerance, stops } = *profile;
        let (ramp_div, pulse_div) = divisors(values);
        let basis = Basis { minimum_speed: values.get(P::MinimumSpeed), ramp_div, pulse_div, tolerance };
        // In velocity mode the target speed may be any, whatever parameter 4 says.
        let speed = if mode == RampMode::Velocity { INTERNAL_MAX } else { speed };
        Settings { basis, mode, stops, speed, acceleration }
    }
}

/// RAMP_DIV and PULSE_DIV (parameters 153 and 154), 0..=13.
pub(super) fn divisors(values: &Values) -> (u8, u8) {
    (values.get(P::RampDivisor) as u8, values.get(P::PulseDivisor) as u8)
}
