//! The braking parameter p of the TMC429, and the accelerations for which the chip can express p (datasheet sections
//! 8.1.7.1 and 8.1.10).
//!
//! p = A / (128 * 2^(RAMP_DIV - PULSE_DIV)) for an acceleration A. The chip takes p as PMUL / 2^(3 + PDIV) with PMUL in
//! 128..=255 and PDIV in 0..=13. The value p' given to the chip is a little smaller, so that the motor does not
//! overshoot. The factor 0.988 keeps the datasheet's criterion 0.95 < p'/p < 1 even after PMUL is truncated (0.988 *
//! 128/129 = 0.980).

use crate::units::{INTERNAL_MAX, Internal};

/// Factor by which p is reduced, in thousandths.
const REDUCTION: u64 = 988;
/// Largest PDIV.
const PDIV_MAX: u32 = 13;
/// Up to this speed, 2048/sqrt(2), half the smallest acceleration of the datasheet is enough for a braking ramp of 2^19
/// microsteps, the chip's longest.
const HALF_LIMIT_SPEED: Internal = 1448;

/// The settings of the ramp generator that belong together in positioning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Braking {
    /// A_MAX, 1..=2047.
    pub acceleration: Internal,
    /// PMUL, 128..=255.
    pub pmul: u8,
    /// PDIV, 0..=13.
    pub pdiv: u8,
}

/// The last answer of [`braking`], with its arguments: most moves ask for the same again, and the answer takes long
/// divisions.
#[derive(Clone, Copy, Debug, Default)]
pub struct BrakingMemo(Option<(Question, Option<Braking>)>);

/// The arguments of [`braking`]; of the speed it is only asked whether half the smallest acceleration is enough for it.
type Question = (Internal, u8, u8, bool);

impl BrakingMemo {
    /// The answer of [`braking`] to these arguments.
    pub fn braking(&mut self, wanted: Internal, ramp_div: u8, pulse_div: u8, speed: Internal) -> Option<Braking> {
        let question = (wanted, ramp_div, pulse_div, speed > HALF_LIMIT_SPEED);
        match self.0 {
            Some((known, answer)) if known == question => answer,
            _ => {
                let answer = braking(wanted, ramp_div, pulse_div, speed);
                self.0 = Some((question, answer));
                answer
            }
        }
    }
}

/// PMUL and PDIV for one acceleration, 1..=2047; `None` if that has none. The divisors are 0..=13.
fn pair(acceleration: Internal, ramp_div: u8, pulse_div: u8) -> Option<(u8, u8)> {
    let a = u64::try_from(acceleration).ok()?;
    // PMUL = 0.988 * p * 8 * 2^PDIV = 988 * A * 2^(PULSE_DIV + PDIV) / (1000 * 2^(4 + RAMP_DIV)), truncated. At most
    // 988 * 2047 * 2^26 < 2^47.
    let largest = ((REDUCTION * a) << (u32::from(pulse_div) + PDIV_MAX) >> (4 + ramp_div)) / 1000;
    // Each PDIV less halves it. There is one for which PMUL has the eight bits of 128..=255, if `largest` has so many.
    let excess = largest.checked_ilog2()?.checked_sub(7)?;
    let pdiv = PDIV_MAX.checked_sub(excess)?;
    Some(((largest >> excess) as u8, pdiv as u8))
}

/// The settings for an acceleration of `wanted` (1..=2047). They have the smallest acceleration from `wanted` on that
/// has a PMUL/PDIV pair and keeps the braking ramp within the chip's 2^19 microsteps at the speed limit `speed`
/// (0..=2047). They have the largest such acceleration if `wanted` lies above them all. `None` if the divisors (0..=13)
/// admit no acceleration.
pub fn braking(wanted: Internal, ramp_div: u8, pulse_div: u8, speed: Internal) -> Option<Braking> {
    let ratio = i32::from(ramp_div) - i32::from(pulse_div);
    // Smallest A with PMUL >= 128 at PDIV 13: 988 * A * 2^(PULSE_DIV + 13) >= 128 000 * 2^(4 + RAMP_DIV).
    let smallest = (128_000_u64 << (4 + ramp_div)).div_ceil(1 << (u32::from(pulse_div) + PDIV_MAX)).div_ceil(REDUCTION);
    let smallest = i32::try_from(smallest).ok().filter(|a| *a <= INTERNAL_MAX)?;
    // The datasheet's limits are 2^(ratio - 1) below and 2^(ratio + 12) - 1 above, where ratio stands for RAMP_DIV -
    // PULSE_DIV. For slow motion the limit below is half of that, which `smallest` is.
    let lower = if speed > HALF_LIMIT_SPEED && ratio >= 1 { smallest.max(1 << (ratio - 1)) } else { smallest };
    let upper = if ratio >= 0 { INTERNAL_MAX } else { (4096 >> -ratio) - 1 };
    // With the ratio at an extreme no acceleration lies between the limits; then the one that has a pair is used.
    let upper = upper.clamp(smallest, INTERNAL_MAX);
    let acceleration = wanted.clamp(lower.min(upper), upper);
    let (pmul, pdiv) = pair(acceleration, ramp_div, pulse_div)?;
    Some(Braking { acceleration, pmul, pdiv })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs worked out by hand from the datasheet's rule, (A, RAMP_DIV, PULSE_DIV) -> (PMUL, PDIV).
    #[test]
    fn pairs_of_the_datasheet_rule() {
        for ((a, r, p), expected) in [
            ((500, 3, 2), (247, 4)),
            ((1000, 7, 3), (247, 6)),
            ((2047, 7, 3), (252, 5)),
            ((100, 7, 5), (197, 7)),
            ((1, 0, 0), (252, 12)),
            ((2047, 0, 0), (252, 1)),
        ] {
            assert_eq!(pair(a, r, p), Some(expected), "A {a} R {r} P {p}");
        }
        assert_eq!(pair(2047, 0, 13), None);
        assert_eq!(pair(1, 13, 0), None);
    }

    /// 0.95 < p'/p < 1 for every acceleration and divisor pair that has one, in exact arithmetic. Here p'/p = PMUL *
    /// 128 * 2^R / (2^(3 + PDIV) * A * 2^P).
    #[test]
    fn every_pair_keeps_the_datasheets_criterion() {
        let mut pairs = 0;
        for r in 0..=13_u8 {
            for p in 0..=13_u8 {
                for a in 1..=2047 {
                    let Some((pmul, pdiv)) = pair(a, r, p) else { continue };
                    pairs += 1;
                    let ours = u128::from(pmul) << (7 + u32::from(r));
                    let exact = (a as u128) << (3 + u32::from(pdiv) + u32::from(p));
                    assert!(100 * ours > 95 * exact && ours < exact, "A {a} R {r} P {p}");
                }
            }
        }
        assert!(pairs > 200_000, "only {pairs} pairs");
    }

    #[test]
    fn accelerations_without_a_pair_are_raised() {
        // At the default divisors 7/3 the accelerations 1..=4 have no pair; 5 has 988 * 5 * 2^16 / (1000 * 2^11) = 158.
        assert_eq!(braking(1, 7, 3, 1000), Some(Braking { acceleration: 5, pmul: 158, pdiv: 13 }));
        // Above the speed 1448 an acceleration below 2^(7 - 3 - 1) = 8 would need a braking ramp longer than 2^19
        // microsteps.
        assert_eq!(braking(1, 7, 3, 2047).map(|b| b.acceleration), Some(8));
        assert_eq!(braking(1000, 7, 3, 2047).map(|b| b.acceleration), Some(1000));
        // With RAMP_DIV 0 and PULSE_DIV 6 the largest acceleration is 2^6 - 1.
        assert_eq!(braking(1000, 0, 6, 2047).map(|b| b.acceleration), Some(63));
    }

    /// The only divisor pairs for which no acceleration exists, whatever acceleration and speed are wanted, are those
    /// whose divisors differ by 13.
    #[test]
    fn divisor_pairs_without_braking() {
        for r in 0..=13_u8 {
            for p in 0..=13_u8 {
                let any = (1..=2047).any(|a| pair(a, r, p).is_some());
                for (wanted, speed) in [(1, 1), (1, 2047), (1000, 1), (1000, 2047), (2047, 1), (2047, 2047)] {
                    assert_eq!(braking(wanted, r, p, speed).is_some(), any, "A {wanted} R {r} P {p} V {speed}");
                }
            }
        }
        assert_eq!(braking(1, 0, 13, 1), None);
        assert_eq!(braking(1, 13, 0, 1), None);
    }
}
