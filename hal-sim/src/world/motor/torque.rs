//! How much torque a motor has at a speed: no more than its current makes, and no more than the supply lets through.

use super::FULL_TORQUE;
use core::f64::consts::{FRAC_PI_2, SQRT_2};

/// Voltage that the bridges and the sense resistor take of the supply, in volts. Two MOSFETs of some 40 mOhm and 100
/// mOhm for the sense resistor at 2.8 A are 0.5 V.
const BRIDGE_DROP: f64 = 0.5;

/// The winding of a motor at a driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winding {
    /// Resistance of a phase in ohms.
    pub resistance: f64,
    /// Inductance of a phase in henries; above 0.
    pub inductance: f64,
    /// The back-EMF of a phase, in volts for a radian per second, electrical: K'.
    pub back_emf: f64,
    /// The peak of the driver's full current, in amperes.
    pub full_current: f64,
}

impl Winding {
    /// The winding of a motor from the figures of its data sheet, at a driver whose full current is `full_current`
    /// amperes RMS. The holding torque, in newton metres, is that of two phases with the rated current: K I sqrt(2). A
    /// motor has a pole pair for each four full steps of a turn, and K = `pairs` K'.
    pub fn of_data_sheet(
        [resistance, inductance]: [f64; 2],
        (holding_torque, rated_current): (f64, f64),
        steps_per_turn: u32,
        full_current: f64,
    ) -> Self {
        let pairs = f64::from(steps_per_turn) / 4.0;
        let back_emf = holding_torque / (SQRT_2 * rated_current * pairs);
        Self { resistance, inductance, back_emf, full_current: full_current * SQRT_2 }
    }

    /// The torque, in 1/65536 of that at full current, that `volts` of supply let through at a speed in full steps per
    /// second. It is K (V / Z - K' w R / Z^2), where Z^2 = R^2 + (w L)^2. The electrical angular speed is w, a quarter
    /// of a turn for each full step (Acarnley, Stepping Motors: the pull-out torque under constant voltage). Without
    /// enough voltage for the back-EMF it is 0.
    pub fn torque(&self, volts: f64, full_steps: f64) -> u32 {
        let Self { resistance, inductance, back_emf, full_current } = *self;
        let speed = full_steps * FRAC_PI_2;
        let reactance = speed * inductance;
        let square = resistance * resistance + reactance * reactance;
        let volts = (volts - BRIDGE_DROP).max(0.0);
        let current = volts / square.sqrt() - back_emf * speed * resistance / square;
        // The conversion limits what does not fit, as at standstill without resistance.
        (current / full_current * f64::from(FULL_TORQUE)) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 17HS19-2004S1 at a driver of 2 A RMS.
    fn winding() -> Winding {
        Winding::of_data_sheet([1.4, 3.0e-3], (0.59, 2.0), 200, 2.0)
    }

    /// 0.59 Nm / (sqrt(2) x 2 A x 50) = 4.172 mVs. At 3000 full steps/s w is 4712.4 / s, w L is 14.14 ohms and Z 14.21
    /// ohms. So 23.5 V / 14.21 ohms = 1.654 A. Of this 4.172 mVs x 4712.4 / s x 1.4 ohms / 201.8 ohms^2 = 0.136 A are
    /// lost. What is left is 1.518 A of 2.828 A.
    #[test]
    fn a_worked_example() {
        assert!((winding().back_emf - 4.172e-3).abs() < 1e-6);
        let share = f64::from(winding().torque(24.0, 3000.0)) / f64::from(FULL_TORQUE);
        assert!((share - 1.518 / 2.828).abs() < 5e-4, "{share}");
    }

    /// 23.5 V / 1.4 ohms are 16.8 A, nearly six times the full current.
    #[test]
    fn a_motor_that_stands_has_more_voltage_than_it_needs() {
        let share = f64::from(winding().torque(24.0, 0.0)) / f64::from(FULL_TORQUE);
        assert!((share - 16.786 / 2.8284).abs() < 1e-3, "{share}");
    }

    #[test]
    fn without_voltage_there_is_no_torque() {
        assert_eq!((winding().torque(0.3, 100.0), winding().torque(1.0, 20.0) > 0), (0, true));
        let weak = Winding { resistance: 100.0, ..winding() };
        assert_eq!(weak.torque(1.0, 2_000.0), 0);
    }
}
