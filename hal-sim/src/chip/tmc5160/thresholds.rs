//! The velocity thresholds: the time of a microstep against TPWMTHRS, TCOOLTHRS and THIGH, with hysteresis (6.2, 10).

use super::registers::{
    Registers,
    address::{GCONF, TCOOLTHRS, THIGH, TPWMTHRS},
};

/// GCONF.small_hysteresis.
const SMALL_HYSTERESIS: u32 = 14;

/// For each threshold, whether the motor is faster than it. A threshold of 0 is never passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Thresholds {
    /// Too fast for stealthChop.
    pub(super) pwm: bool,
    /// Fast enough for coolStep and stallGuard2.
    pub(super) cool: bool,
    /// Too fast for coolStep.
    pub(super) high: bool,
}

impl Thresholds {
    /// The thresholds that are passed with a `step` of TSTEP, where these were before.
    pub(super) fn with(self, step: u32, registers: &Registers) -> Self {
        let hysteresis = if registers.bit(GCONF, SMALL_HYSTERESIS) { 32 } else { 16 };
        let passed = |before: bool, threshold: u32, slow: bool| {
            // "(Txxx*15/16)-1 or (Txxx*31/32)-1 is used as a second compare value."
            let fast = threshold * (hysteresis - 1) / hysteresis;
            threshold != 0 && (step < fast || before && !slow)
        };
        let [pwm, cool, high] = [TPWMTHRS, TCOOLTHRS, THIGH].map(|address| registers.get(address));
        Self {
            // "TSTEP >= TPWMTHRS: stealthChop", but "TCOOLTHRS >= TSTEP: coolStep" (6.2).
            pwm: passed(self.pwm, pwm, step >= pwm),
            cool: passed(self.cool, cool, step > cool),
            high: passed(self.high, high, step > high),
        }
    }
}
