//! Numbers of an axis as turns of its motor, or as whatever a user counts in.

use tmcm::param::{AxisParameter as P, Parameter, Unit};

use super::live::{Live, Settings};
use crate::product::Product;

/// The physical quantity that a number of an axis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Physical {
    /// A position in microsteps.
    Position,
    /// A speed, in the product's unit.
    Speed,
    /// An acceleration, in the product's unit.
    Acceleration,
}

impl Physical {
    /// The physical quantity that the value of a parameter is; `None` for one that is none of these.
    pub fn of(parameter: &Parameter<P>) -> Option<Self> {
        let is_acceleration = matches!(
            parameter.function,
            P::MaximumAcceleration
                | P::FirstAcceleration
                | P::MaximumDeceleration
                | P::LastDeceleration
                | P::ActualAcceleration
        );
        match parameter.row.unit {
            Unit::Microsteps => Some(Physical::Position),
            Unit::Pps2 => Some(Physical::Acceleration),
            Unit::Internal | Unit::Pps if is_acceleration => Some(Physical::Acceleration),
            Unit::Internal | Unit::Pps => Some(Physical::Speed),
            _ => None,
        }
    }

    /// The text behind the name of a unit of length for this quantity: nothing, `/s`, or `/s2`.
    pub fn suffix(self) -> &'static str {
        match self {
            Physical::Position => "",
            Physical::Speed => "/s",
            Physical::Acceleration => "/s2",
        }
    }
}

/// A unit of length, in which positions are counted.
#[derive(Clone, Copy, Debug)]
pub struct Length {
    live: Live,
    /// Number of microsteps that one of it has.
    microsteps: f64,
}

impl Length {
    /// A unit of so many microsteps, or a turn of the motor.
    ///
    /// # Errors
    /// That is no number above zero.
    pub fn new(product: Product, settings: Settings, microsteps: Option<f64>) -> Result<Self, String> {
        let turn = f64::from(settings.microsteps) * f64::from(settings.steps);
        let microsteps = microsteps.unwrap_or(turn);
        if microsteps.is_finite() && microsteps > 0.0 {
            Ok(Length { live: Live::new(product, settings), microsteps })
        } else {
            Err("a unit has a number of microsteps above zero".into())
        }
    }

    /// A number of the axis in this unit, or in this unit per second, or per second twice.
    pub fn shown(self, physical: Physical, number: i32) -> f64 {
        let microsteps = match physical {
            Physical::Position => number.into(),
            Physical::Speed => self.live.speed_in_pulses(number),
            Physical::Acceleration => self.live.acceleration_in_pulses(number),
        };
        microsteps / self.microsteps
    }

    /// The number of the axis that is nearest to this.
    ///
    /// # Errors
    /// The axis has no such number.
    pub fn number(self, physical: Physical, shown: f64) -> Result<i32, String> {
        let microsteps = shown * self.microsteps;
        let none = || format!("{shown} is no number that the axis has");
        match physical {
            _ if !microsteps.is_finite() => Err(none()),
            Physical::Position => {
                let rounded = microsteps.round();
                let fits = (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded);
                fits.then_some(rounded as i32).ok_or_else(none)
            }
            // What is converted further is exact, and has at most 15 digits.
            _ if microsteps.abs() >= 1e10 => Err(none()),
            Physical::Speed => self.live.speed(&format!("{microsteps:.4} pps")),
            Physical::Acceleration => self.live.acceleration(&format!("{microsteps:.4} pps2")),
        }
    }

    /// The number of the axis that is nearest to a value with a unit of `tmcl calc`: `60 rpm`.
    ///
    /// # Errors
    /// A message about what is no such value of the axis.
    pub fn typed(self, physical: Physical, text: &str) -> Result<i32, String> {
        match physical {
            Physical::Position => Err(format!("'{text}' is no number")),
            Physical::Speed => self.live.speed(text),
            Physical::Acceleration => self.live.acceleration(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings = Settings { divisors: (5, 7), microsteps: 256, steps: 200, in_chip: false };

    /// Internal speeds are 16 MHz * v / (2^5 * 2048 * 32) microsteps a second: 1000 are 7629.39, which are 0.149 turns.
    #[test]
    fn a_turn_has_51_200_microsteps() {
        let turns = Length::new(Product::Tmcm1140, SETTINGS, None).unwrap();
        assert_eq!(turns.shown(Physical::Position, 25_600), 0.5);
        assert_eq!(turns.number(Physical::Position, -0.5), Ok(-25_600));
        let speed = turns.shown(Physical::Speed, 1000);
        assert!((speed - 7_629.394_531 / 51_200.0).abs() < 1e-9, "{speed}");
        assert_eq!(turns.number(Physical::Speed, speed), Ok(1000));
        assert_eq!(turns.typed(Physical::Speed, "8.941 rpm"), Ok(1000));
        let acceleration = turns.shown(Physical::Acceleration, 500);
        assert_eq!(turns.number(Physical::Acceleration, acceleration), Ok(500));
        assert!(turns.number(Physical::Position, 1e9).is_err() && turns.number(Physical::Speed, f64::NAN).is_err());
        assert!(turns.number(Physical::Speed, 1e12).is_err() && turns.typed(Physical::Position, "1 rpm").is_err());
    }

    /// A spindle of 4 mm a turn: 12 800 microsteps are a millimetre. The TMCM-3212 counts in pps.
    #[test]
    fn a_user_counts_in_millimetres() {
        let settings = Settings { divisors: (0, 0), ..SETTINGS };
        let mm = Length::new(Product::Tmcm3212, settings, Some(12_800.0)).unwrap();
        assert_eq!((mm.shown(Physical::Position, 51_200), mm.shown(Physical::Speed, 25_600)), (4.0, 2.0));
        assert_eq!((mm.number(Physical::Position, 4.0), mm.number(Physical::Speed, 2.0)), (Ok(51_200), Ok(25_600)));
        assert!(Length::new(Product::Tmcm3212, settings, Some(0.0)).is_err());
    }

    #[test]
    fn each_parameter_is_what_its_unit_says() {
        let of = |product: Product, number| Physical::of(product.spec().axis.find(number).unwrap());
        for product in [Product::Tmcm1140, Product::Tmcm3212] {
            assert_eq!(of(product, 1), Some(Physical::Position));
            assert_eq!(of(product, 4), Some(Physical::Speed));
            assert_eq!(of(product, 5), Some(Physical::Acceleration));
            assert_eq!(of(product, 6), None);
        }
    }
}
