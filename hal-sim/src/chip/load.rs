//! How the drivers react to the load on the motor: stallGuard2 measures it, and coolStep sets the current by it.

use super::bits::field;
use crate::clock::{Nanos, SECOND};
use crate::random::Random;

/// The load on the motor as a ratio of the torque it demands to the torque the current gives:
/// [`FULL_LOAD`] is the load that stalls it.
pub type LoadRatio = u32;
/// The load ratio at which the motor stalls.
pub const FULL_LOAD: LoadRatio = 65_536;

/// The longest time of a full step, at 32 full steps a second, in which the back-EMF of this model's motor can be
/// measured; a slower one reads zero.
const SLOWEST: Nanos = SECOND / 32;
/// Contribution of one unit of SGT to the reading.
const SGT_SPAN: i64 = 64;
/// With SFILT there is one reading for this many full steps, of the mean of their loads.
const FILTERED: u32 = 4;

/// The response of stallGuard2 to the load on a motor. By the datasheet both the matched threshold and the slope are
/// properties of motor, current and speed, not of the chip, and the user finds them by experiment. SGT makes up for
/// what is lost in the resistance of the coils. The reading lives on the back-EMF, of which a slow motor has little
/// (TMC5160 datasheet, sections 13.1 and 13.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Response {
    /// The SGT at which the reading is zero exactly where the motor stalls, -64..=63.
    pub zero: i32,
    /// Contribution of the whole torque reserve to the reading, 1..=1023.
    pub span: u32,
    /// Speed in full steps per second below which the back-EMF, and with it the span, falls in proportion to the speed.
    /// It is 0 for a motor that has the whole span at any speed.
    pub speed: u32,
    /// Amplitude of the noise on the reading, 0..=1023.
    pub noise: u32,
}

impl Default for Response {
    fn default() -> Self {
        Self { zero: 5, span: 512, speed: 0, noise: 0 }
    }
}

impl Response {
    /// Contribution of the whole torque reserve at a speed at which a full step takes so long.
    fn span_at(&self, full_step: Nanos) -> i64 {
        let (whole, slow) = (u128::from(SECOND), u128::from(full_step) * u128::from(self.speed));
        (u128::from(self.span) * whole / whole.max(slow)) as i64
    }
}

/// The settings of stallGuard2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Threshold {
    /// SGT, -64..=63.
    pub(super) sgt: i32,
    /// SFILT.
    pub(super) filtered: bool,
}

/// The measurement stallGuard2. The load ratio l is 0 for a free motor, and 1 stalls it. The reading is `span x (1 -
/// l) + 64 x (SGT - zero)` with noise, held within 0..=1023. With the usual [`Response`] and at SGT 5 it is 512 for the
/// free motor and zero exactly where the motor stalls. SGT 5 is the default of the firmware and the value that
/// application note AN016 uses. Each unit of SGT above adds 64.
#[derive(Clone, Debug)]
pub(super) struct StallGuard {
    value: u16,
    last: Nanos,
    full_steps: u32,
    /// Sum of the loads in the full steps since the last reading.
    loads: LoadRatio,
    response: Response,
    random: Random,
}

impl StallGuard {
    pub(super) fn new(response: Response, seed: u64) -> Self {
        Self { value: 0, last: 0, full_steps: 0, loads: 0, response, random: Random::new(seed) }
    }

    pub(super) fn reset(&mut self) {
        self.value = 0;
        self.full_steps = 0;
        self.loads = 0;
    }

    pub(super) fn value(&self) -> u16 {
        self.value
    }

    /// Takes the load in a full step that ended at `at`. Returns the value of a reading that this full step completes.
    /// At standstill no full step ends, and the last value stays.
    pub(super) fn measure(&mut self, at: Nanos, load: LoadRatio, threshold: Threshold, driven: bool) -> Option<u16> {
        let took = at.saturating_sub(self.last);
        self.last = at;
        self.full_steps += 1;
        self.loads += load.min(FULL_LOAD);
        if threshold.filtered && self.full_steps < FILTERED {
            return None;
        }
        let load = self.loads / self.full_steps;
        self.full_steps = 0;
        self.loads = 0;
        self.value = if took > SLOWEST || !driven {
            0
        } else {
            let reserve = FULL_LOAD - load;
            let Response { zero, noise, .. } = self.response;
            let over = i64::from(threshold.sgt) - i64::from(zero);
            let span = self.response.span_at(took);
            let mut value = span * i64::from(reserve) / i64::from(FULL_LOAD) + SGT_SPAN * over;
            if noise > 0 {
                let spread = 2 * noise + 1;
                value += i64::from(self.random.below(spread)) - i64::from(noise);
            }
            value.clamp(0, 1023) as u16
        };
        Some(self.value)
    }
}

/// coolStep: with SEMIN > 0 a reading below SEMIN x 32 raises the current scale by SEUP's step. As many readings of at
/// least (SEMIN + SEMAX + 1) x 32 as SEDN says lower it by one. The scale stays between CS and the half or quarter of
/// CS that SEIMIN selects (rounded down).
///
/// `control` are the 16 low bits of SMARTEN or COOLCONF, which are alike; `full` is CS or IRUN.
#[derive(Clone, Debug, Default)]
pub(super) struct CoolStep {
    scale: u32,
    above: u32,
}

impl CoolStep {
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }

    /// The current scale in force (SE), 0..=31: the current is one more than this in 1/32 of the full current.
    pub(super) fn scale(&self) -> u32 {
        self.scale
    }

    /// Brings the current scale to a changed configuration: to CS with coolStep off, and within its limits with
    /// coolStep on.
    pub(super) fn limit(&mut self, control: u32, full: u32) {
        let (lowest, highest) = limits(control, full);
        self.scale = if field(control, 0, 4) == 0 { highest } else { self.scale.clamp(lowest, highest) };
    }

    /// Returns to the full current, because coolStep is not in charge.
    pub(super) fn release(&mut self, full: u32) {
        self.scale = full;
        self.above = 0;
    }

    pub(super) fn adapt(&mut self, reading: u16, control: u32, full: u32) {
        let semin = field(control, 0, 4);
        if semin == 0 {
            return;
        }
        let (lowest, highest) = limits(control, full);
        let reading = u32::from(reading);
        if reading < semin * 32 {
            self.above = 0;
            self.scale = (self.scale + (1 << field(control, 5, 2))).min(highest);
        } else if reading >= (semin + field(control, 8, 4) + 1) * 32 {
            self.above += 1;
            let needed = match field(control, 13, 2) {
                0 => 32,
                1 => 8,
                2 => 2,
                _ => 1,
            };
            if self.above >= needed {
                self.above = 0;
                self.scale = self.scale.saturating_sub(1).max(lowest);
            }
        }
    }
}

/// The lowest and highest current scale: a half or quarter of the full one, and that.
fn limits(control: u32, full: u32) -> (u32, u32) {
    (full >> (1 + field(control, 15, 1)), full)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reading of a free motor whose full steps take so many milliseconds, or of one with a load.
    fn reading(response: Response, sgt: i32, full_step: Nanos, load: LoadRatio) -> u16 {
        let mut stall_guard = StallGuard::new(response, 1);
        let threshold = Threshold { sgt, filtered: false };
        stall_guard.measure(SECOND, load, threshold, true);
        stall_guard.measure(SECOND + full_step, load, threshold, true).expect("a reading for each full step")
    }

    /// 512 x (1 - 1/4) + 64 x (2 - 5) = 192.
    #[test]
    fn the_usual_motor() {
        let reading = |sgt, load| reading(Response::default(), sgt, SECOND / 100, load);
        assert_eq!((reading(2, FULL_LOAD / 4), reading(-3, 0), reading(-2, 0)), (192, 0, 64));
        assert_eq!((reading(5, 0), reading(5, FULL_LOAD), reading(6, FULL_LOAD)), (512, 0, 64));
    }

    /// Another motor: zero where it stalls at SGT -3, and 300 more without load. 300 x 1/2 + 64 x 1 = 214.
    #[test]
    fn each_motor_has_its_threshold_and_its_slope() {
        let response = Response { zero: -3, span: 300, ..Response::default() };
        let reading = |sgt, load| reading(response, sgt, SECOND / 100, load);
        assert_eq!((reading(-3, 0), reading(-3, FULL_LOAD), reading(-2, FULL_LOAD / 2)), (300, 0, 214));
    }

    /// At 50 of 200 full steps a second a quarter of the span is left, and no more than all of it at 400.
    #[test]
    fn a_slow_motor_has_little_back_emf() {
        let response = Response { zero: 0, span: 400, speed: 200, ..Response::default() };
        let reading = |full_steps: Nanos| reading(response, 0, SECOND / full_steps, 0);
        assert_eq!((reading(50), reading(200), reading(400)), (100, 400, 400));
    }
}
