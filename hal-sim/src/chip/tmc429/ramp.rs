//! Arithmetic of the ramp generator: the braking law, arrival, and how long nothing changes.

/// Velocities carry 8 bits behind the point (datasheet 8.1.10.2).
pub(super) const FRACTION_BITS: u32 = 8;

/// The deceleration ramp is internally limited to this many steps (8.1.7.1.1). With the smallest p, 128/2^16 = 1/512,
/// the law then ends at sqrt(2048 * 2^19 / 512) = 1448. This is the very value that 8.1.7.1.1 names as the V_MAX below
/// which half the lower limit of A_MAX will do.
const LONGEST_BRAKING: u32 = 1 << 19;

/// The proportionality factor p = PMUL / 2^(3 + PDIV) of the braking law (8.1.10.1).
#[derive(Debug, Clone, Copy)]
pub(super) struct Proportion {
    /// Mantissa, 128..=255.
    pub(super) pmul: u32,
    /// Exponent as stored, 0..=15.
    pub(super) pdiv: u32,
}

impl Proportion {
    /// p * `steps`, times 2048 if `scaled`, rounded down.
    fn times(self, steps: u32, scaled: bool) -> u64 {
        let steps = u64::from(steps.min(LONGEST_BRAKING));
        let up = if scaled { 11 } else { 0 };
        ((u64::from(self.pmul) * steps) << up) >> (3 + self.pdiv)
    }

    /// The velocity of ramp_mode at `distance` steps from the target, limited to `limit`.
    ///
    /// The datasheet prints p = 2048 / S with S the length of the ramp from velocity 2048 (8.1.10.2). With a constant
    /// deceleration v^2 is proportional to the distance: v^2 = 2048^2 * d / S = 2048 * p * d.
    pub(super) fn linear_ramp(self, distance: u32, limit: u32) -> u32 {
        let square = self.times(distance, true);
        let limit_square = u64::from(limit) * u64::from(limit);
        match u32::try_from(square) {
            Ok(square) if u64::from(square) < limit_square => square.isqrt(),
            _ => limit,
        }
    }

    /// The shortest distance at which `linear_ramp` gives `limit`, if it ever does.
    pub(super) fn linear_ramp_length(self, limit: u32) -> Option<u32> {
        // (2048 * PMUL * d) >> (3 + PDIV) >= limit^2
        let square = u64::from(limit) * u64::from(limit);
        Self::length((square << (3 + self.pdiv)).div_ceil(u64::from(self.pmul) << 11))
    }

    /// The shortest distance at which `exponential` gives `limit`, if it ever does.
    pub(super) fn exponential_length(self, limit: u32) -> Option<u32> {
        Self::length((u64::from(limit) << (3 + self.pdiv)).div_ceil(u64::from(self.pmul)))
    }

    fn length(distance: u64) -> Option<u32> {
        u32::try_from(distance).ok().filter(|distance| *distance <= LONGEST_BRAKING)
    }

    /// The velocity of soft_mode at `distance` steps from the target, limited to `limit`.
    ///
    /// A velocity that is proportional to the distance decays exponentially (8.1.11.1); v = p * d meets
    /// the law of ramp_mode at full speed, d = S.
    pub(super) fn exponential(self, distance: u32, limit: u32) -> u32 {
        u32::try_from(self.times(distance, false)).map_or(limit, |velocity| velocity.min(limit))
    }
}

/// Number of ramp ticks by which the velocity may lag behind the braking law on arrival.
const LAG: u32 = 5;

/// The greatest velocity (with fraction) at which the motor stops on the target instead of running through.
///
/// The datasheet says two things. V_MIN is the velocity "at or below which the stepper motor can be stopped abruptly"
/// (8.1.3). A p that is too large "will cause overshooting and even oscillations" (8.1.10.1). So reaching the target
/// does not stop the motor from any velocity. But V_MIN = 1 is a good setting and the braking law still asks for
/// sqrt(2048 * p) at one step before the target. Both fit together if the chip brakes with A_MAX after the last step
/// and that ends before another step is due. From velocity v the way to rest is v^2 * 2^(RAMP_DIV - PULSE_DIV) / (16 *
/// A_MAX) steps. This is less than one for v below sqrt(16 * A_MAX * 2^(PULSE_DIV - RAMP_DIV)), which is sqrt(2048 * p)
/// for the p that matches. The model stops at once in that case.
///
/// On top come [`LAG`] ramp ticks of A_MAX. The law is a square root, ever steeper towards the target, and the velocity
/// follows it only once a ramp tick and by A_MAX at most: it arrives late. The law was followed tick by tick with p
/// reduced by 1 to 2 % and RAMP_DIV up to PULSE_DIV + 12, from many distances. The velocity on the target was never
/// more than 4.6 ticks above zero for large ratios and 5.1 for small ones. The datasheet promises that such a p reaches
/// the target without overshooting, so the chip copes.
pub(super) fn arrival_limit(v_min: u32, a_max: u32, pulse_div: u32, ramp_div: u32) -> u32 {
    // A_MAX < 2^11, so 16 * A_MAX * 2^15 fits into 32 bits.
    let within_a_step = (((16 * a_max) << pulse_div) >> ramp_div).isqrt();
    (v_min.max(within_a_step) << FRACTION_BITS) + LAG * a_max
}

/// Counts ramp ticks up to the next one at which something visible happens while the velocity moves from `velocity`
/// towards `goal` by `step` per tick. Visible is that the integer part changes (it sets the pulse rate), that the sign
/// changes, or that the goal is reached. `step` and the difference must not be zero.
pub(super) fn quiet_ticks(velocity: i32, goal: i32, step: u32) -> u64 {
    let reach = goal.abs_diff(velocity).div_ceil(step);
    let magnitude = velocity.unsigned_abs();
    let whole = magnitude >> FRACTION_BITS;
    let rising = velocity == 0 || (velocity > 0) == (goal > velocity);
    let visible = if rising {
        (((whole + 1) << FRACTION_BITS) - magnitude).div_ceil(step)
    } else if whole > 0 {
        (magnitude - (whole << FRACTION_BITS)) / step + 1
    } else {
        magnitude.div_ceil(step)
    };
    u64::from(visible.min(reach))
}
