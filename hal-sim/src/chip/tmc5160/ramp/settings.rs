//! The registers of the ramp generator, and what follows from them alone: how the speed changes, and when to brake.
//! Speeds have eight bits behind their unit; an acceleration is what a speed changes by every 512 clocks.

use super::super::registers::{Registers, address::*};
use super::{FRACTION_BITS, TICK};

/// The highest VMAX (6.3.1).
const FASTEST: u32 = (1 << 23) - 512;
/// In 512 clocks a speed s goes 512 s, so the way to brake from s by d is 256 s^2/d. Distances are divided by this.
const DISTANCE_BITS: u32 = 8;

/// RAMPMODE.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RampMode {
    /// To the target.
    Position,
    /// With VMAX to higher positions.
    Up,
    /// With VMAX to lower positions.
    Down,
    /// On with the present velocity.
    Hold,
}

/// The settings.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) mode: RampMode,
    pub(super) target: i32,
    pub(super) vstart: u32,
    pub(super) vmax: u32,
    pub(super) amax: u32,
    /// TZEROWAIT in clocks.
    pub(super) zero_wait: u64,
    a1: u32,
    v1: u32,
    dmax: u32,
    d1: u32,
    vstop: u32,
    /// The speed at which D1 begins, or VSTOP where it does not.
    knee: u64,
    /// The way to brake from there to VSTOP.
    from_knee: u64,
    /// The way to brake from VMAX.
    from_vmax: u64,
}

impl Settings {
    pub(super) fn of(registers: &Registers) -> Self {
        let speed = |address| registers.get(address) << FRACTION_BITS;
        let mut settings = Self {
            mode: match registers.get(RAMPMODE) {
                0 => RampMode::Position,
                1 => RampMode::Up,
                2 => RampMode::Down,
                _ => RampMode::Hold,
            },
            target: registers.get(XTARGET).cast_signed(),
            vstart: speed(VSTART),
            vmax: registers.get(VMAX).min(FASTEST) << FRACTION_BITS,
            amax: registers.get(AMAX),
            zero_wait: u64::from(registers.get(TZEROWAIT)) * TICK,
            a1: registers.get(A1),
            v1: speed(V1),
            dmax: registers.get(DMAX),
            d1: registers.get(D1),
            vstop: speed(VSTOP),
            knee: 0,
            from_knee: 0,
            from_vmax: 0,
        };
        let (v1, vstop) = (u64::from(settings.v1), u64::from(settings.vstop));
        settings.knee = v1.max(vstop);
        settings.from_knee = (settings.knee * settings.knee - vstop * vstop) / u64::from(settings.d1.max(1));
        settings.from_vmax = settings.braking_way(settings.vmax);
        settings
    }

    /// The acceleration from a speed on; V1 = 0 disables A1 and D1.
    pub(super) fn acceleration(&self, speed: u32) -> u32 {
        if speed < self.v1 { self.a1 } else { self.amax }
    }

    /// The deceleration from a speed on.
    pub(super) fn deceleration(&self, speed: u32) -> u32 {
        if self.v1 != 0 && speed <= self.v1 { self.d1 } else { self.dmax }
    }

    /// The lowest speed that can follow a speed. A change through V1 may be as large as either deceleration. With the
    /// one above V1 alone the motor would fall behind its way to brake, and be too fast at the target.
    pub(super) fn slowest(&self, speed: u32) -> u32 {
        let slower = speed.saturating_sub(self.deceleration(speed));
        if speed > self.v1 && slower < self.v1 { slower.min(speed.saturating_sub(self.d1)) } else { slower }
    }

    /// A speed that is by `change` nearer to VMAX.
    pub(super) fn approach(&self, speed: u32, change: u32) -> u32 {
        if speed < self.vmax { (speed + change).min(self.vmax) } else { speed.saturating_sub(change).max(self.vmax) }
    }

    /// A speed that is nearer to rest: below VSTOP comes rest.
    pub(super) fn brake(&self, speed: u32) -> u32 {
        let slower = speed.saturating_sub(self.deceleration(speed));
        if slower <= self.vstop { 0 } else { slower }
    }

    /// The highest speed with which the motor stops on its target, of those that a motor at `speed` may have there.
    pub(super) fn arrival(&self, speed: u32) -> u32 {
        self.vstop + self.deceleration(speed)
    }

    /// The number of steps that a motor with VMAX needs to stop, rounded up, and one to spare.
    pub(super) fn braking_steps(&self) -> u32 {
        u32::try_from(self.from_vmax >> (32 - DISTANCE_BITS)).map_or(u32::MAX, |steps| steps.saturating_add(2))
    }

    /// The way to brake from a speed to VSTOP with DMAX and D1. The motor goes on for half a tick more than a ramp that
    /// is a straight line would take it.
    fn braking_way(&self, speed: u32) -> u64 {
        let speed = u64::from(speed);
        let (base, way, deceleration) = if speed > self.knee {
            (self.knee, self.from_knee, self.upper())
        } else {
            (u64::from(self.vstop), 0, self.lower())
        };
        way + (speed * speed).saturating_sub(base * base) / deceleration + speed
    }

    /// The highest speed, `most` at most and VSTOP at least, from which the motor can brake to VSTOP within `distance`
    /// (2^-32 microsteps) of the target. It solves [`braking_way`](Self::braking_way) for the speed.
    pub(super) fn speed_at(&self, distance: u64, most: u32) -> u32 {
        let distance = distance >> DISTANCE_BITS;
        let from_most = if most == self.vmax { self.from_vmax } else { self.braking_way(most) };
        if distance >= from_most {
            return most;
        }
        let (base, way, deceleration) = if distance > self.from_knee + self.knee {
            (self.knee, distance - self.from_knee, self.upper())
        } else {
            (u64::from(self.vstop), distance, self.lower())
        };
        let half = deceleration / 2;
        // Less than the square of `most`, so below 2^63.
        let square = half * half + base * base + deceleration * way;
        let speed = (square as f64).sqrt() as u64 - half;
        (speed as u32).max(self.vstop).min(most)
    }

    /// The deceleration above the knee. The ways that follow from none at all are long enough with the smallest.
    fn upper(&self) -> u64 {
        u64::from(self.dmax.max(1))
    }

    /// The deceleration below the knee.
    fn lower(&self) -> u64 {
        u64::from(if self.v1 == 0 { self.dmax } else { self.d1 }.max(1))
    }
}
