//! The configuration of a TMC262, as the parameters of its axis make it.

use crate::chip::tmc262::Configuration;
use crate::motion::current::Excitation;
use crate::motion::values::Values;
use crate::param::AxisParameter as P;

/// The configuration of the TMC262 for the parameters of an axis and the current that its motion needs.
pub(super) fn configuration(values: &Values, excitation: Excitation) -> Configuration {
    let byte = |parameter: P| values.get(parameter) as u8;
    let flag = |parameter: P| values.is_on(parameter);
    Configuration {
        microsteps: byte(P::MicrostepResolution),
        interpolation: flag(P::StepInterpolation),
        double_edge: flag(P::DoubleStep),
        blank_time: byte(P::ChopperBlankTime),
        constant_toff: flag(P::ConstantToffMode),
        no_fast_decay_comparator: flag(P::DisableFastDecayComparator),
        hysteresis_decrement: byte(P::ChopperHysteresisDecrement),
        hysteresis_end: byte(P::ChopperHysteresisEnd),
        hysteresis_start: byte(P::ChopperHysteresisStart),
        off_time: if excitation.free { 0 } else { byte(P::ChopperOffTime) },
        random_off_time: flag(P::RandomToffMode),
        current_minimum: byte(P::SmartEnergyCurrentMinimum),
        down_step: byte(P::SmartEnergyDownStep),
        hysteresis: byte(P::SmartEnergyHysteresis),
        up_step: byte(P::SmartEnergyUpStep),
        cool_step: if excitation.cool_step { byte(P::SmartEnergyHysteresisStart) } else { 0 },
        filter: flag(P::StallGuardFilter),
        threshold: values.get(P::StallGuardThreshold) as i8,
        current: excitation.scale,
        slope_high: byte(P::SlopeHighSide),
        slope_low: byte(P::SlopeLowSide),
        no_short_protection: flag(P::ShortProtectionDisable),
        short_timer: byte(P::ShortDetectionTimer),
        vsense: flag(P::Vsense),
    }
}
