//! The axis for which values are converted: what its product can have, and what it makes of a number.

use tmcm::module::Spec;
use tmcm::param::{self, AxisParameter};

use super::exact::Exact;
use super::scale::{Generator, MotionUnit, Quantity, Scale};
use super::value::Value;

/// Largest pulse divisor, and ramp divisor (manual chapter 4, parameters 153 and 154).
pub const MOST_DIVIDED: u8 = 13;

/// Advice on what to do about millimetres that mean nothing yet.
pub(super) const NO_LEAD: &str =
    "how far a turn of the motor moves the stage is not known; give it in mm with --lead, for example --lead 4";

/// An axis of a product.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// The description of its product.
    pub(super) spec: &'static Spec,
    /// The meaning of its numbers.
    pub(super) scale: Scale,
}

/// The speed or acceleration that a module makes of a wanted one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Made {
    /// The speed or acceleration as it was wanted, in pps or pps2.
    pub(super) wanted: Exact,
    /// The number of the generator's own units that comes next to it.
    pub(super) own: i128,
    /// The number that is written to a parameter, with its unit.
    pub(super) written: (i128, MotionUnit),
    /// The speed or acceleration that the motor gets, in pps or pps2.
    pub(super) actual: Exact,
}

impl Axis {
    /// The unit in which the product's parameters have speeds and accelerations unless a setting says otherwise.
    pub(super) fn usual_unit(self) -> MotionUnit {
        let row = self.spec.axis.row(AxisParameter::MaximumSpeed);
        match row.map(|row| row.unit) {
            Some(param::Unit::Internal) => MotionUnit::Internal,
            _ => MotionUnit::Pulses,
        }
    }

    /// The parameter with the unit mode, of products whose usual unit is not that of their chip: while it is 0, they
    /// take numbers of the chip.
    pub(super) fn unit_mode(self) -> Option<u8> {
        let row = self.spec.axis.row(AxisParameter::UnitMode);
        row.filter(|_| self.usual_unit() != self.scale.generator.own_unit()).map(|row| row.number)
    }

    /// The divisors that a quantity depends on, in words in front of others.
    pub(super) fn divisors(self, quantity: Quantity) -> String {
        match (self.scale.generator, quantity) {
            (Generator::Tmc429 { pulse_divisor, .. }, Quantity::Speed) => format!("pulse divisor {pulse_divisor}, "),
            (Generator::Tmc429 { pulse_divisor, ramp_divisor }, Quantity::Acceleration) => {
                format!("pulse divisor {pulse_divisor}, ramp divisor {ramp_divisor}, ")
            }
            (Generator::Tmc5160, _) => String::new(),
        }
    }

    /// The largest number that the product takes as a maximum speed, or a maximum acceleration.
    fn most(self, quantity: Quantity) -> i128 {
        let parameter = match quantity {
            Quantity::Speed => AxisParameter::MaximumSpeed,
            Quantity::Acceleration => AxisParameter::MaximumAcceleration,
        };
        let row = self.spec.axis.row(parameter);
        row.and_then(|row| row.ranges.last()).map_or(0, |(_, high)| i128::from(*high))
    }

    /// Finds what the module makes of a value.
    ///
    /// # Errors
    /// Why it cannot have it, with what could be done about it.
    pub(super) fn make(self, value: &Value, quantity: Quantity, unit: MotionUnit) -> Result<Made, String> {
        let Value { text, number, .. } = value;
        let (name, generator) = (self.spec.usb, self.scale.generator);
        let Some(wanted) = self.scale.pulses(quantity, unit, *number) else {
            if unit == MotionUnit::Millimetres {
                return Err(format!("{text}: {NO_LEAD}"));
            }
            let units: Vec<&str> = self.scale.units().map(|unit| unit.name(quantity)).collect();
            let (unit, units) = (unit.name(quantity), units.join(", "));
            return Err(format!("{text}: a {name} has no unit '{unit}'; its units are {units}"));
        };
        if quantity == Quantity::Acceleration && number.is_negative() {
            return Err(format!("{text}: an acceleration has no sign, because it slows the motor down, too"));
        }
        // A number of the generator's own units is taken as it is, any other one goes through the product's usual unit.
        let (own, usual) = (generator.own_unit(), self.usual_unit());
        let written = if unit == own { own } else { usual };
        let most = if written == usual { self.most(quantity) } else { generator.largest(quantity) };
        let asked = Asked { quantity, unit, written, number: *number };
        let refused = |bound: &str, limit: i128, fits: &dyn Fn(i128) -> bool| {
            let limit = asked.limit(self.scale, limit);
            let way = self.divided(|scale| asked.whole(scale).is_some_and(fits));
            let way = way.map_or_else(String::new, |divisor| format!(". It is possible with {divisor}"));
            Err(format!("{text}: {} of a {name} is {bound} {limit}{way}", quantity.name()))
        };
        let whole = asked.whole(self.scale).unwrap_or_default();
        if whole.abs() > most {
            return refused("at most", most, &|whole| whole.abs() <= most);
        }
        if whole == 0 && !number.is_zero() {
            return refused("0 or at least", 1, &|whole| whole != 0);
        }
        let pulses = |unit, number| self.scale.pulses(quantity, unit, Exact::whole(number)).unwrap_or(wanted);
        let in_chip = self.scale.number(quantity, own, pulses(written, whole)).map_or(whole, Exact::rounded);
        let largest = generator.largest(quantity);
        // An acceleration that is not 0 is at least 1 in the chip: without any the motor would not get on.
        let least = if quantity == Quantity::Acceleration { whole.min(1) } else { -largest };
        let in_chip = in_chip.clamp(least, largest);
        Ok(Made { wanted, own: in_chip, written: (whole, written), actual: pulses(own, in_chip) })
    }

    /// The option for the divisor with which `fits` holds, if there is one; of several the one nearest to that of now.
    fn divided(self, fits: impl Fn(Scale) -> bool) -> Option<String> {
        let Generator::Tmc429 { pulse_divisor: pulse, ramp_divisor: ramp } = self.scale.generator else { return None };
        let found = |name: &str, now: u8, with: &dyn Fn(u8) -> Generator| {
            let divisors = (0..=MOST_DIVIDED).filter(|divisor| fits(Scale { generator: with(*divisor), ..self.scale }));
            let nearest = divisors.min_by_key(|divisor| divisor.abs_diff(now));
            nearest.map(|divisor| format!("--{name} {divisor}"))
        };
        // Where the ramp divisor has an effect, it is the one to be changed, because speeds stay as they are.
        let by_ramp =
            found("ramp-divisor", ramp, &|ramp_divisor| Generator::Tmc429 { pulse_divisor: pulse, ramp_divisor });
        by_ramp.or_else(|| {
            found("pulse-divisor", pulse, &|pulse_divisor| Generator::Tmc429 { pulse_divisor, ramp_divisor: ramp })
        })
    }
}

/// A number of a unit that is to be written in another one.
#[derive(Clone, Copy, Debug)]
struct Asked {
    quantity: Quantity,
    unit: MotionUnit,
    written: MotionUnit,
    number: Exact,
}

impl Asked {
    /// The whole number nearest to it in the unit in which it is written.
    fn whole(self, scale: Scale) -> Option<i128> {
        let pulses = scale.pulses(self.quantity, self.unit, self.number)?;
        scale.number(self.quantity, self.written, pulses).map(Exact::rounded)
    }

    /// A limit in both units.
    fn limit(self, scale: Scale, limit: i128) -> String {
        let written = format!("{limit} {}", self.written.name(self.quantity));
        let pulses = scale.pulses(self.quantity, self.written, Exact::whole(limit));
        match pulses.and_then(|pulses| scale.number(self.quantity, self.unit, pulses)) {
            Some(number) if self.unit != self.written => {
                format!("{} {} ({written})", number.shown(), self.unit.name(self.quantity))
            }
            _ => written,
        }
    }
}

#[cfg(test)]
mod tests {
    use tmcm::product::TMCM_3212;

    use super::super::value;
    use super::*;

    const AXIS: Axis = Axis {
        spec: &TMCM_3212,
        scale: Scale { generator: Generator::Tmc5160, microsteps: 256, steps: 200, lead: None },
    };

    /// Finds what the module makes of a value as the first thing that it can be.
    fn made(text: &str, quantity: Quantity, unit: MotionUnit) -> Result<Made, String> {
        let values = value::read(&TMCM_3212, &[text.into()]).expect("a value");
        AXIS.make(values.first().expect("one"), quantity, unit)
    }

    /// 60 rpm are 51200 pps, 51200 * 2^24 / 16e6 = 53687.0912 of the chip's units. It gets 53687, of which each is 16e6
    /// / 2^24 = 15625 / 16384 pps.
    #[test]
    fn a_number_goes_through_pps_into_the_chip() {
        let made = made("60 rpm", Quantity::Speed, MotionUnit::PerMinute).unwrap();
        assert_eq!((made.wanted, made.written, made.own), (Exact::whole(51_200), (51_200, MotionUnit::Pulses), 53_687));
        assert_eq!(made.actual, Exact::ratio(53_687 * 15_625, 16_384));
    }

    /// The largest speed of the manual is beyond what the chip documents, 2^23 - 512, which it gets.
    #[test]
    fn the_chip_ends_before_the_parameter() {
        let made = |text: &str| made(text, Quantity::Speed, MotionUnit::Pulses);
        assert_eq!(made("7999774 pps").map(|made| made.own), Ok(8_388_096));
        assert_eq!(made("7999775 pps").unwrap_err(), "7999775 pps: a speed of a TMCM-3212 is at most 7999774 pps");
    }

    /// 1 pps2 is less than a hundredth of the chip's unit, 256e12 / 2^41 = 116.4 pps2, which it becomes.
    #[test]
    fn an_acceleration_does_not_vanish() {
        let made = |text: &str| made(text, Quantity::Acceleration, MotionUnit::Pulses).unwrap();
        assert_eq!((made("1 pps2").own, made("174 pps2").own, made("175 pps2").own, made("0 pps2").own), (1, 1, 2, 0));
        assert_eq!(made("1 pps2").actual.shown(), "116.415322");
    }

    /// While the unit mode is 0, a number is the chip's own.
    #[test]
    fn a_number_of_the_chip_is_taken_as_it_is() {
        let chip = |text: &str, quantity| made(text, quantity, MotionUnit::Chip);
        let made = chip("10 chip", Quantity::Speed).unwrap();
        assert_eq!((made.own, made.written, made.actual), (10, (10, MotionUnit::Chip), Exact::ratio(156_250, 16_384)));
        assert!(chip("65536 chip", Quantity::Speed).is_ok());
        assert_eq!(
            chip("65536 chip", Quantity::Acceleration).unwrap_err(),
            "65536 chip: an acceleration of a TMCM-3212 is at most 65535 chip"
        );
    }
}
