//! The registers of a TMC5160 that configure its driver, as the parameters of its axis make them. An exponent, a choice
//! or a flag of a parameter becomes a field (TMC5160 datasheet sections 6.2, 6.4 and 6.5).

use super::unit::{LONGEST, SpeedUnit};
use crate::chip::tmc5160::{Register, gconf};
use crate::motion::current::Excitation;
use crate::motion::values::Values;
use crate::param::AxisParameter as P;

/// The chip's unit of TPOWERDOWN, 2^18 clocks, in microseconds.
const POWER_DOWN_UNIT: u32 = 16_384;
/// The unit of parameter 214 in microseconds.
const HUNDREDTH: u32 = 10_000;

/// PWM_LIM and PWM_REG as after a reset: how fast the automatic current control of stealthChop may go.
const PWM_CONTROL: u32 = 12 << 28 | 4 << 24;
/// TPFD as after a reset: the passive fast decay time.
const PASSIVE_FAST_DECAY: u32 = 4 << 20;
/// The largest ENC_CONST, 32767.99998.
const LARGEST: u64 = i32::MAX as u64;
/// enc_sel_decimal in ENCMODE: the fraction of ENC_CONST is in 1/10000.
const DECIMAL: u32 = 1 << 10;

/// The driver's registers. `pwm` switches stealthChop on, which the chip allows at standstill only.
pub(super) fn words(values: &Values, excitation: Excitation, pwm: bool) -> [(Register, u32); 14] {
    let word = |parameter: P| values.get(parameter) as u32;
    let flag = |parameter: P, bit: u32| if values.is_on(parameter) { 1_u32.unbounded_shl(bit) } else { 0 };
    let unit = SpeedUnit::of(values);
    let period = |speed: i32| unit.period(speed, values.get(P::MicrostepResolution));
    // For these thresholds a speed of 0 means never.
    let above = |parameter: P| if values.is_on(parameter) { period(values.get(parameter)) } else { 0 };

    let shaft = if values.is_on(P::ReverseShaft) { gconf::SHAFT } else { 0 };
    let pwm_mode = if pwm { gconf::EN_PWM_MODE } else { 0 };
    let run = word(P::MaximumCurrent) >> 3;
    let hold = word(P::StandbyCurrent) >> 3;
    let power_down = word(P::PowerDownDelay).saturating_mul(HUNDREDTH).saturating_add(POWER_DOWN_UNIT / 2);
    let (scale, decimal) = encoder_scale(values);
    let mode = word(P::EncoderMode) & 0x3FF;
    [
        (Register::Gconf, gconf::MULTISTEP_FILT | shaft | pwm_mode),
        (Register::IholdIrun, hold | run << 8 | word(P::PowerDownRamp) << 16),
        (Register::TPowerDown, (power_down / POWER_DOWN_UNIT).min(255)),
        (Register::TPwmThrs, above(P::PwmThresholdSpeed)),
        (Register::TCoolThrs, cool_threshold(values).map_or(0, |speed| passed_at(period(speed)))),
        (Register::THigh, above(P::HighSpeedThreshold)),
        (Register::VdcMin, unit.speed(values.get(P::DcStepMinimumSpeed))),
        (Register::ChopConf, chopper(values, excitation)),
        (Register::CoolConf, cool_step(values, excitation)),
        (Register::DcCtrl, word(P::DcStepTime) | word(P::DcStepStallGuard) << 16),
        (
            Register::PwmConf,
            PWM_CONTROL
                | word(P::FreewheelingMode) << 20
                | flag(P::PwmAutoscale, 19)
                | flag(P::PwmAutoscale, 18)
                | word(P::PwmFrequency) << 16
                | word(P::PwmGradient) << 8
                | word(P::PwmAmplitude),
        ),
        (Register::EncMode, mode | if decimal { DECIMAL } else { 0 }),
        // The encoder counts the other way when the motor turns the other way.
        (Register::EncConst, if shaft == 0 { scale } else { negated(scale, decimal) }),
        (Register::EncDeviation, word(P::ChipEncoderDeviation)),
    ]
}

/// True if the parameters ask for stealthChop at low speeds: it needs a threshold (186) and a gradient (187).
pub(super) fn pwm_wanted(values: &Values) -> bool {
    values.is_on(P::PwmThresholdSpeed) && values.is_on(P::PwmGradient)
}

/// The lower one of the speeds above which a stall stops the motor (181; 0: never) and above which coolStep works
/// (182), because the chip has one threshold for both; `None` if neither is on. Between the two, the other one is
/// switched by the firmware.
fn cool_threshold(values: &Values) -> Option<i32> {
    let stall = Some(values.get(P::StopOnStall)).filter(|speed| *speed > 0);
    let cool = values.is_on(P::SmartEnergyHysteresisStart).then(|| values.get(P::SmartEnergyThresholdSpeed));
    [stall, cool].into_iter().flatten().min()
}

/// The threshold that a motor passes on its way up with this period of a microstep. The chip takes it for faster only
/// when its period is below 15/16 of the threshold, less 1 (datasheet section 6.2, TSTEP). On its way down the motor is
/// below the threshold at 15/16 of that speed. Until there it is the firmware that has switched off what the speed is
/// too low for.
const fn passed_at(period: u32) -> u32 {
    let threshold = period.saturating_add(3).saturating_mul(16) / 15;
    if threshold < LONGEST { threshold } else { LONGEST }
}

/// CHOPCONF.
fn chopper(values: &Values, excitation: Excitation) -> u32 {
    let word = |parameter: P| values.get(parameter) as u32;
    let flag = |parameter: P, bit: u32| if values.is_on(parameter) { 1_u32.unbounded_shl(bit) } else { 0 };
    let (end, start) = (word(P::ChopperHysteresisEnd), word(P::ChopperHysteresisStart));
    let decay = if values.is_on(P::ConstantToffMode) {
        // Parameter 165 is the fast decay time, whose highest bit has a place of its own, and 166 the offset.
        (end & 0b111) << 4 | start.min(15) << 7 | (end >> 3 & 1) << 11 | 1 << 14
    } else {
        start.min(7) << 4 | end << 7
    };
    let off_time = if excitation.free { 0 } else { word(P::ChopperOffTime) };
    let microsteps = 8_u32.saturating_sub(word(P::MicrostepResolution));
    off_time
        | decay
        | flag(P::DisableFastDecayComparator, 12)
        | word(P::ChopperBlankTime) << 15
        | flag(P::HighSpeedFullStepMode, 18)
        | flag(P::HighSpeedChopperMode, 19)
        | PASSIVE_FAST_DECAY
        | microsteps << 24
        | flag(P::ShortProtectionDisable, 30)
        | flag(P::ShortProtectionDisable, 31)
}

/// COOLCONF.
fn cool_step(values: &Values, excitation: Excitation) -> u32 {
    let word = |parameter: P| values.get(parameter) as u32;
    let start = if excitation.cool_step { word(P::SmartEnergyHysteresisStart) } else { 0 };
    start
        | word(P::SmartEnergyUpStep) << 5
        | word(P::SmartEnergyHysteresis) << 8
        | word(P::SmartEnergyDownStep) << 13
        | word(P::SmartEnergyCurrentMinimum) << 15
        | (word(P::StallGuardThreshold) & 0x7F) << 16
        | word(P::StallGuardFilter) << 24
}

/// The microsteps in a count of the encoder, as a fixed point number of 16.16 bits, or with a fraction of 1/10000 where
/// only that is exact. The second value tells whether it has such a fraction. Without an encoder it is 0.
fn encoder_scale(values: &Values) -> (u32, bool) {
    let microsteps = values.get(P::FullStepResolution) as u64;
    let turn = microsteps.unbounded_shl(values.get(P::MicrostepResolution).unsigned_abs());
    let counts = values.get(P::EncoderResolution) as u64;
    let scaled = |by: u64| turn.wrapping_mul(by).checked_div(counts);
    let is_exact = |by: u64| turn.wrapping_mul(by).checked_rem(counts) == Some(0);
    let (Some(binary), Some(decimal)) = (scaled(1 << 16), scaled(10_000)) else { return (0, false) };
    // 16 bits before the point, one of them the sign.
    if binary <= LARGEST && is_exact(10_000) && !is_exact(1 << 16) {
        (((decimal / 10_000) << 16 | (decimal % 10_000)) as u32, true)
    } else {
        (binary.min(LARGEST) as u32, false)
    }
}

/// The negative of a scale (datasheet chapter 20: `0xFFE6.4000` is -25.6 in decimal mode).
const fn negated(scale: u32, decimal: bool) -> u32 {
    let (whole, fraction) = (scale >> 16, scale & 0xFFFF);
    if !decimal || fraction == 0 {
        return scale.wrapping_neg();
    }
    !whole << 16 | 10_000_u32.wrapping_sub(fraction)
}
