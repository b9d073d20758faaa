//! An axis of a module that is at hand: what its numbers mean by its present settings.

use tmcm::param::AxisParameter as P;

use super::axis::Axis;
use super::exact::Exact;
use super::scale::{Generator, MotionUnit, Quantity, Scale};
use super::value::{self, Meaning};
use crate::conversation::{Conversation, Error};
use crate::product::{Product, axis_number};

/// The settings of an axis on which the meaning of its numbers depends.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Pulse and ramp divisor (parameters 154 and 153), of products that have them.
    pub divisors: (u8, u8),
    /// Microsteps per full step, a power of two up to 256.
    pub microsteps: u16,
    /// Full steps per turn of the motor, at least 1.
    pub steps: u16,
    /// The numbers are units of the chip, by the unit mode.
    pub in_chip: bool,
}

impl Settings {
    /// Asks a module for the settings of an axis, whose motor has so many full steps per turn.
    ///
    /// # Errors
    /// The link fails.
    pub fn read(module: &mut Conversation, axis: u8, steps: u16) -> Result<Self, Error> {
        let product = module.product()?;
        let in_chip = module.is_in_chip_units(axis)?;
        let mut known = |parameter, otherwise| match axis_number(product, parameter) {
            Some(_) => module.axis(axis, parameter),
            None => Ok(otherwise),
        };
        let divisor = |number: i32| u8::try_from(number).unwrap_or_default();
        let divisors = (divisor(known(P::PulseDivisor, 0)?), divisor(known(P::RampDivisor, 0)?));
        let microsteps = 1 << known(P::MicrostepResolution, 8)?.clamp(0, 8);
        Ok(Settings { divisors, microsteps, steps, in_chip })
    }
}

/// An axis with its settings.
#[derive(Clone, Copy, Debug)]
pub struct Live {
    axis: Axis,
    unit: MotionUnit,
}

impl Live {
    /// An axis of a product.
    pub fn new(product: Product, settings: Settings) -> Self {
        let Settings { divisors, microsteps, steps, in_chip } = settings;
        let spec = product.spec();
        let scale = Scale { generator: Generator::of(spec, divisors), microsteps, steps, lead: None };
        let axis = Axis { spec, scale };
        let unit = if in_chip { axis.scale.generator.own_unit() } else { axis.usual_unit() };
        Live { axis, unit }
    }

    /// The unit of the axis' speeds.
    pub fn unit(self) -> &'static str {
        self.unit.name(Quantity::Speed)
    }

    /// The number of a speed as a user writes it, with any unit of `tmcl calc`, or without one for the axis' own.
    ///
    /// # Errors
    /// A message about what is no speed of the axis.
    pub fn speed(self, text: &str) -> Result<i32, String> {
        self.number(text, Quantity::Speed, "speed", "60 rpm")
    }

    /// The number of an acceleration, as [`Live::speed`] has that of a speed.
    ///
    /// # Errors
    /// A message about what is no acceleration of the axis.
    pub fn acceleration(self, text: &str) -> Result<i32, String> {
        self.number(text, Quantity::Acceleration, "acceleration", "10 rps/s")
    }

    fn number(self, text: &str, quantity: Quantity, name: &str, example: &str) -> Result<i32, String> {
        let alone =
            !text.trim().is_empty() && text.trim().bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte));
        let own = self.unit.name(quantity);
        let text = if alone { format!("{} {own}", text.trim()) } else { text.trim().to_owned() };
        let values = value::read(self.axis.spec, std::slice::from_ref(&text))?;
        let [value] = values.as_slice() else {
            return Err(format!("'{text}' is not one {name}; write for example {example}"));
        };
        let unit = value.meanings.iter().find_map(|meaning| match meaning {
            Meaning::Motion(meant, unit) if *meant == quantity => Some(*unit),
            _ => None,
        });
        let unit = unit.ok_or_else(|| format!("{text}: that is no {name}; write for example {example}"))?;
        let made = self.axis.make(value, quantity, unit)?;
        let number = match made.written {
            (number, unit) if unit == self.unit => Some(number),
            _ => self.axis.scale.number(quantity, self.unit, made.actual).map(Exact::rounded),
        };
        let number = number.and_then(|number| i32::try_from(number).ok());
        number.ok_or_else(|| format!("{text}: that is no number of {own}"))
    }

    /// A speed of the axis in microsteps per second.
    pub fn speed_in_pulses(self, number: i32) -> f64 {
        self.pulses(Quantity::Speed, number)
    }

    /// An acceleration of the axis in microsteps per second, per second.
    pub fn acceleration_in_pulses(self, number: i32) -> f64 {
        self.pulses(Quantity::Acceleration, number)
    }

    fn pulses(self, quantity: Quantity, number: i32) -> f64 {
        let pulses = self.axis.scale.pulses(quantity, self.unit, Exact::whole(number));
        pulses.map_or(0.0, Exact::approximate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings = Settings { divisors: (5, 7), microsteps: 256, steps: 200, in_chip: false };

    /// Pulse divisor 5: a unit is 16e6 / (2^5 * 65536) = 7.629 pps, so 1 rps = 51200 pps are 6711 of them.
    #[test]
    fn speeds_with_and_without_a_unit() {
        let live = Live::new(Product::Tmcm1140, SETTINGS);
        assert_eq!((live.unit(), live.speed("800"), live.speed("15 rpm")), ("int", Ok(800), Ok(1678)));
        assert_eq!(live.speed_in_pulses(800), 800.0 * 16e6 / 32.0 / 65_536.0);
        assert_eq!(live.acceleration_in_pulses(1), 16e6 * 16e6 / 2_f64.powi(41));
        assert_eq!(live.speed("60 s").unwrap_err(), "60 s: that is no speed; write for example 60 rpm");
        assert!(live.speed("60 rpn").unwrap_err().contains("did you mean 'rpm'?"));
        assert!(live.speed("2048").unwrap_err().contains("at most 2047"));
        assert!(live.speed("").is_err());
    }

    /// A TMCM-3212 has pps, or units of its chip, of which each is 16e6 / 2^24 = 0.9537 pps.
    #[test]
    fn speeds_of_a_product_with_two_units() {
        let live = |in_chip| Live::new(Product::Tmcm3212, Settings { in_chip, ..SETTINGS });
        assert_eq!((live(false).unit(), live(false).speed("1 rps")), ("pps", Ok(51_200)));
        assert_eq!((live(true).unit(), live(true).speed("1 rps")), ("chip", Ok(53_687)));
        assert_eq!((live(true).speed("1000"), live(false).speed("1000 chip")), (Ok(1000), Ok(954)));
    }
}
