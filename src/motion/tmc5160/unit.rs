//! The units of speed and acceleration in which the parameters of an axis on a TMC5160 are (parameter 255), and those
//! of its registers (TMC5160 datasheet section 12.1).
//!
//! With the clock of 16 MHz a speed of 1 in a register is 16e6 / 2^24 = 0.9537 microsteps per second (pps). An
//! acceleration of 1 is 16e6^2 / 2^41 = 116.4 pps per second.

use crate::chip::tmc5160::CLOCK;
use crate::motion::values::Values;
use crate::param::AxisParameter as P;

/// The largest speed that VMAX takes: 2^23 - 512, which is 7 999 512 pps.
pub(super) const TOP_SPEED: u32 = (1 << 23) - 512;
/// The largest speed in pps.
const TOP_PPS: u32 = 7_999_512;
/// The end of the range of parameters 3 and 29, in either unit.
const RANGE: i32 = 7_999_774;
/// The largest number of a register with the period of a microstep: 20 bits.
pub(super) const LONGEST: u32 = (1 << 20) - 1;

/// Register units in a pps, less one, in 2^-32: 2^24 / 16e6 = 1.048576.
const SPEED: u64 = 208_632_331;
/// Register units in a pps per second, in 2^-32: 2^41 / 16e6^2 = 0.008 589 934 592.
const ACCELERATION: u64 = 36_893_488;
/// A half in units of 2^-32, for rounding.
const HALF: u64 = 1 << 31;

/// The unit of an axis' speeds and accelerations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SpeedUnit {
    /// The unit of the registers.
    Register,
    /// Microsteps per second (pps), and pps per second.
    Pps,
}

impl SpeedUnit {
    /// The unit that parameter 255 chooses.
    pub(super) fn of(values: &Values) -> Self {
        if values.is_on(P::UnitMode) { SpeedUnit::Pps } else { SpeedUnit::Register }
    }

    /// The magnitude of a speed in the unit of the registers, rounded.
    pub(super) fn speed(self, speed: i32) -> u32 {
        let speed = speed.unsigned_abs();
        match self {
            SpeedUnit::Register => speed,
            SpeedUnit::Pps => {
                let more = u64::from(speed).wrapping_mul(SPEED).wrapping_add(HALF) >> 32;
                speed.saturating_add(more as u32)
            }
        }
    }

    /// An acceleration in the unit of the registers, rounded, 1..=65535: with 0 a motor could not be stopped.
    pub(super) fn acceleration(self, acceleration: i32) -> u32 {
        let acceleration = acceleration.unsigned_abs();
        let register = match self {
            SpeedUnit::Register => acceleration,
            SpeedUnit::Pps => (u64::from(acceleration).wrapping_mul(ACCELERATION).wrapping_add(HALF) >> 32) as u32,
        };
        register.clamp(1, u32::from(u16::MAX))
    }

    /// The speed of a register, in the unit of the axis, rounded.
    pub(super) fn of_register(self, speed: i32) -> i32 {
        match self {
            // A motor at its top speed may have been told it in pps.
            SpeedUnit::Register => speed.clamp(-RANGE, RANGE),
            // 16e6 / 2^24 is 15625 / 2^14.
            SpeedUnit::Pps => (i64::from(speed).wrapping_mul(15_625).wrapping_add(1 << 13) >> 14) as i32,
        }
    }

    /// The acceleration of a register, in the unit of the axis, rounded: the register of that is the same again.
    pub(super) fn of_acceleration(self, register: u32) -> i32 {
        match self {
            SpeedUnit::Register => register as i32,
            // 16e6^2 / 2^41 is 15 258 789.06 / 2^17.
            SpeedUnit::Pps => (u64::from(register).wrapping_mul(15_258_789).wrapping_add(1 << 16) >> 17) as i32,
        }
    }

    /// By what the square of the speed grows with each microstep at an acceleration of a register, in 1/256 of the
    /// square of the unit of the axis. It is 2 a in pps, and in registers 2^8 a (datasheet section 12.1, ramp steps).
    pub(super) fn growth(self, register: u32) -> u32 {
        match self {
            SpeedUnit::Register => register.saturating_mul(1 << 16),
            SpeedUnit::Pps => self.of_acceleration(register).unsigned_abs().saturating_mul(2 << 8),
        }
    }

    /// The clocks in 1/256 of a full step at a speed, with 2^`resolution` microsteps in a full step; at most
    /// [`LONGEST`], which is also that of speed 0.
    pub(super) fn period(self, speed: i32, resolution: i32) -> u32 {
        let pps = self.of_speed(speed).unsigned_abs();
        let clocks = CLOCK.unbounded_shr(8_u32.saturating_sub(resolution.unsigned_abs()));
        clocks.checked_div(pps).unwrap_or(LONGEST).min(LONGEST)
    }

    /// The speed that a period of 1/256 of a full step is, in the unit of the axis; 0 for [`LONGEST`].
    pub(super) fn of_period(self, period: u32, resolution: i32) -> i32 {
        let clocks = CLOCK.unbounded_shr(8_u32.saturating_sub(resolution.unsigned_abs()));
        let pps = if period == LONGEST { 0 } else { clocks.checked_div(period).unwrap_or_default() };
        // Periods are measured in whole clocks, so at its top speed a motor seems to be faster still.
        let pps = pps.min(TOP_PPS);
        match self {
            SpeedUnit::Register => (SpeedUnit::Pps.speed(pps as i32) as i32).min(RANGE),
            SpeedUnit::Pps => pps as i32,
        }
    }

    /// A speed in pps.
    fn of_speed(self, speed: i32) -> i32 {
        match self {
            SpeedUnit::Register => SpeedUnit::Pps.of_register(speed),
            SpeedUnit::Pps => speed,
        }
    }
}

/// VACTUAL, a number of 24 bits in two's complement.
pub(super) const fn signed_speed(word: u32) -> i32 {
    ((word << 8) as i32) >> 8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 51 200 pps * 2^24 / 16e6 = 53 687.09; 51 200 pps/s * 2^41 / 16e6^2 = 439.80.
    #[test]
    fn numbers_are_converted_by_the_formulas_of_the_datasheet() {
        assert_eq!(SpeedUnit::Pps.speed(51_200), 53_687);
        assert_eq!(SpeedUnit::Pps.speed(-51_200), 53_687);
        assert_eq!(SpeedUnit::Pps.acceleration(51_200), 440);
        assert_eq!(SpeedUnit::Pps.of_register(53_687), 51_200);
        assert_eq!(SpeedUnit::Pps.of_register(-53_687), -51_200);
        assert_eq!([SpeedUnit::Register.speed(1_000), SpeedUnit::Register.acceleration(1_000)], [1_000, 1_000]);
    }

    /// 7 999 774 pps is 8 388 371.0 (0x7FFF13); 7 629 278 pps/s is 65 535.0.
    #[test]
    fn the_ends_of_the_published_ranges_are_those_of_the_registers() {
        assert_eq!(SpeedUnit::Pps.speed(7_999_774), 0x7F_FF13);
        assert_eq!(SpeedUnit::Pps.acceleration(7_629_278), 65_535);
        assert_eq!(SpeedUnit::Pps.acceleration(i32::MAX), 65_535);
        assert_eq!(
            [SpeedUnit::Pps.acceleration(0), SpeedUnit::Register.acceleration(0), SpeedUnit::Pps.acceleration(200)],
            [1, 1, 2]
        );
        assert_eq!([1, 440, 65_535].map(|register| SpeedUnit::Pps.of_acceleration(register)), [116, 51_223, 7_629_278]);
    }

    /// Numbers a little less than a half over a whole number are rounded down. In the register, 7 996 243 pps would be
    /// 8 384 668.499 97, and 7 628 405 pps/s are 65 527.499 99.
    #[test]
    fn what_is_less_than_a_half_is_rounded_down() {
        assert_eq!(SpeedUnit::Pps.speed(7_996_243), 8_384_668);
        assert_eq!([7_628_405, 7_628_987].map(|value| SpeedUnit::Pps.acceleration(value)), [65_527, 65_532]);
    }

    /// 0.9537 pps each: 10 are 9.54 and 11 are 10.49.
    #[test]
    fn speeds_of_registers_are_rounded_to_the_nearest() {
        assert_eq!(
            [0, 1, 10, 11, -1, -10, -11].map(|speed| SpeedUnit::Pps.of_register(speed)),
            [0, 1, 10, 10, -1, -10, -10]
        );
    }

    /// With each microstep at an acceleration a the square of the speed grows by 2 a: 440 in the register are 51 223
    /// pps/s. In registers, with speeds in 2^-24 and accelerations in 2^-41, that is 2^8 a. Both are in 1/256.
    #[test]
    fn the_square_of_the_speed_grows_with_each_microstep() {
        assert_eq!([0, 440].map(|register| SpeedUnit::Pps.growth(register)), [0, 2 * 51_223 * 256]);
        assert_eq!([0, 440].map(|register| SpeedUnit::Register.growth(register)), [0, 440 * 256 * 256]);
    }

    /// At 1000 pps a microstep of 1/256 lasts 16e6 / 1000 = 16 000 clocks; of 1/16 (resolution 4) it has 16 parts.
    #[test]
    fn periods_are_those_of_the_finest_microsteps() {
        assert_eq!(SpeedUnit::Pps.period(1_000, 8), 16_000);
        assert_eq!(SpeedUnit::Pps.period(1_000, 4), 1_000);
        assert_eq!([SpeedUnit::Pps.period(0, 8), SpeedUnit::Pps.period(1, 8)], [LONGEST; 2]);
        assert_eq!(SpeedUnit::Pps.of_period(16_000, 8), 1_000);
        assert_eq!([LONGEST, 2, 1].map(|period| SpeedUnit::Pps.of_period(period, 8)), [0, 7_999_512, 7_999_512]);
        // Numbers of registers end where those of the parameters do.
        assert_eq!(
            [SpeedUnit::Register.of_period(2, 8), SpeedUnit::Register.of_register(-8_388_096)],
            [7_999_774, -7_999_774]
        );
        // 1049 in the register is 1000.4 pps.
        assert_eq!(SpeedUnit::Register.period(1_049, 8), 16_000);
        assert_eq!(SpeedUnit::Register.of_period(16_000, 8), 1_049);
    }
}
