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
/// Contribution of the whole torque reserve to the reading.
const RESERVE_SPAN: i64 = 512;
/// Contribution of one unit of SGT to the reading.
const SGT_SPAN: i64 = 64;
/// The SGT at which the reading is zero exactly when the motor stalls.
const SGT_MATCHED: i64 = 13;
/// With SFILT there is one reading for this many full steps, of the mean of their loads.
const FILTERED: u32 = 4;

/// The settings of stallGuard2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Threshold {
    /// SGT, -64..=63.
    pub(super) sgt: i32,
    /// SFILT.
    pub(super) filtered: bool,
}

/// The measurement stallGuard2. For a load ratio l (0 is a free motor, 1 stalls it) the reading is `512 x (1 - l) + 64
/// x (SGT - 13)`, held within 0..=1023: 0 for the free motor at SGT 5, 64 more for each unit of SGT above, and at SGT
/// 13 zero exactly where the motor stalls. Slope and matched threshold are properties of this model's motor, not of the
/// chip: by the datasheet the user finds both by experiment.
#[derive(Clone, Debug)]
pub(super) struct StallGuard {
    value: u16,
    last: Nanos,
    full_steps: u32,
    /// Sum of the loads in the full steps since the last reading.
    loads: LoadRatio,
    noise: u32,
    random: Random,
}

impl StallGuard {
    pub(super) fn new(noise: u32, seed: u64) -> Self {
        Self { value: 0, last: 0, full_steps: 0, loads: 0, noise, random: Random::new(seed) }
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
            let over = i64::from(threshold.sgt) - SGT_MATCHED;
            let mut value = RESERVE_SPAN * i64::from(reserve) / i64::from(FULL_LOAD) + SGT_SPAN * over;
            if self.noise > 0 {
                let spread = 2 * self.noise + 1;
                value += i64::from(self.random.below(spread)) - i64::from(self.noise);
            }
            value.clamp(0, 1023) as u16
        };
        Some(self.value)
    }
}

/// coolStep: with SEMIN > 0 a reading below SEMIN x 32 raises the current scale by SEUP's step, and as many
/// readings of at least (SEMIN + SEMAX + 1) x 32 as SEDN says lower it by one, between CS and the half or
/// quarter of CS that SEIMIN selects (rounded down).
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
