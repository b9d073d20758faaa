//! Values of parameters as a user reads and writes them: in the module's units, in physical ones, or in one of the
//! user's own.

use tmcm::param::{AxisParameter, Unit};

use super::file::Setting;
use super::list::range;
use super::place;
use crate::calc::{Current, Length, Physical, Settings};
use crate::product::{Product, axis_number, numbers, symbol};

/// The unit of positions in physical units.
const TURNS: &str = "turns";
/// Fewest and most digits of a number that is shown.
const DIGITS: std::ops::RangeInclusive<usize> = 4..=12;
/// Full steps per turn of a usual motor.
const USUAL_STEPS: u16 = 200;

/// In which units values are shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Units {
    /// In those of the module.
    Module,
    /// Positions, speeds and accelerations in turns of the motor, currents in milliamperes.
    Physical,
    /// Positions, speeds and accelerations in a unit of the user's, the others as physical ones.
    Own {
        /// The name of the unit.
        name: String,
        /// The number of microsteps that one of it has.
        microsteps: f64,
    },
}

/// The scales of an axis: what its values are physically.
#[derive(Clone, Debug)]
struct Scales {
    length: Length,
    name: String,
    current: Current,
}

/// A physical value of a parameter.
enum Of<'a> {
    Motion(&'a Scales, Physical),
    Current(Current),
}

/// How values of an axis, and of the whole module, are shown.
#[derive(Clone, Debug)]
pub struct Shown {
    product: Option<Product>,
    in_chip: bool,
    scales: Option<Scales>,
}

impl Shown {
    /// For an axis of which `known` gives the values that are known, by the numbers of the parameters; the others are
    /// taken to be as in a new module. `steps` are the full steps per turn of its motor, where the module is not told.
    ///
    /// # Errors
    /// The product is not known, so that there are no other units than those of the module; or a unit of the user's is
    /// none.
    pub fn new(
        product: Option<Product>,
        known: &dyn Fn(u8) -> Option<i32>,
        steps: Option<u16>,
        units: Units,
    ) -> Result<Self, String> {
        let value = |parameter| {
            let row = numbers(product).axis.row(parameter)?;
            Some(known(row.number).unwrap_or(row.default))
        };
        let in_chip = product.is_some() && value(AxisParameter::UnitMode) == Some(0);
        let (name, microsteps) = match units {
            Units::Module => return Ok(Shown { product, in_chip, scales: None }),
            Units::Physical => (TURNS.into(), None),
            Units::Own { name, microsteps } => (name, Some(microsteps)),
        };
        let product =
            product.ok_or("the product of this module is not known: its values are shown in the module's units")?;
        let small = |parameter| value(parameter).and_then(|value| u8::try_from(value).ok()).unwrap_or_default();
        let told = axis_number(Some(product), AxisParameter::FullStepResolution)
            .and_then(known)
            .and_then(|steps| u16::try_from(steps).ok());
        let settings = Settings {
            divisors: (small(AxisParameter::PulseDivisor), small(AxisParameter::RampDivisor)),
            microsteps: 1 << value(AxisParameter::MicrostepResolution).unwrap_or(8).clamp(0, 8),
            steps: told.or(steps).filter(|steps| *steps > 0).unwrap_or(USUAL_STEPS),
            in_chip,
        };
        let length = Length::new(product, settings, microsteps)?;
        Ok(Shown {
            product: Some(product),
            in_chip,
            scales: Some(Scales { length, name, current: Current::of(product) }),
        })
    }

    /// Finds what the value of a setting is physically; `None` if it is shown as it is.
    fn physical(&self, setting: Setting) -> Option<Of<'_>> {
        let (Setting::Axis { number, .. }, Some(scales)) = (setting, &self.scales) else { return None };
        let found = numbers(self.product).axis.find(number)?;
        match found.row.unit {
            Unit::Current => Some(Of::Current(scales.current)),
            _ => Some(Of::Motion(scales, Physical::of(found)?)),
        }
    }

    /// The unit of a setting; empty where a number speaks for itself.
    pub fn unit(&self, setting: Setting) -> String {
        match self.physical(setting) {
            Some(Of::Motion(Scales { name, .. }, physical)) => format!("{name}{}", physical.suffix()),
            Some(Of::Current(_)) => Current::UNIT.into(),
            None => setting.row(self.product).map_or("", |row| symbol(row.unit, self.in_chip)).into(),
        }
    }

    /// The value of a setting, without its unit: with as few digits as give the same value when they are typed.
    pub fn text(&self, setting: Setting) -> String {
        let number = setting.value();
        let (shown, is_same): (f64, Box<dyn Fn(f64) -> bool>) = match self.physical(setting) {
            None => return number.to_string(),
            Some(Of::Motion(Scales { length, .. }, physical)) => {
                let length = *length;
                let is_same = move |typed| length.number(physical, typed) == Ok(number);
                (length.shown(physical, number), Box::new(is_same))
            }
            // Several numbers are the same current, and give the coils one of 32 parts of the full one.
            Some(Of::Current(current)) => {
                let shown = current.shown(number);
                (shown, Box::new(move |typed: f64| (typed - shown).abs() < 0.01))
            }
        };
        let texts = DIGITS.map(|digits| decimal(shown, digits));
        let exact = texts.into_iter().find(|text| text.parse().is_ok_and(&is_same));
        exact.unwrap_or_else(|| decimal(shown, *DIGITS.end()))
    }

    /// The value that a text is which a user has typed for a setting.
    ///
    /// # Errors
    /// It is none, or not one that the parameter takes.
    pub fn number(&self, setting: Setting, text: &str) -> Result<i32, String> {
        let plain = text.trim();
        let number = match (self.physical(setting), plain.parse::<f64>()) {
            (None, _) => place::value(plain, self.product)?,
            (Some(Of::Current(current)), _) => current.number(plain)?,
            (Some(Of::Motion(Scales { length, .. }, physical)), Ok(shown)) => length.number(physical, shown)?,
            (Some(Of::Motion(Scales { length, name, .. }, physical)), Err(_)) => {
                // A text may repeat the unit that is shown.
                let unit = format!("{name}{}", physical.suffix());
                let shown = plain.strip_suffix(unit.as_str()).and_then(|shown| shown.trim().parse().ok());
                shown.map_or_else(|| length.typed(physical, plain), |shown| length.number(physical, shown))?
            }
        };
        match setting.row(self.product).filter(|row| !row.accepts(number)) {
            Some(row) if self.physical(setting).is_some() => {
                Err(format!("{plain} would be {number}; {} takes {}", row.name, range(row)))
            }
            Some(row) => Err(format!("{} takes {}", row.name, range(row))),
            None => Ok(number),
        }
    }
}

/// A number with so many digits from the first on that is not 0, without zeros at the end.
fn decimal(number: f64, digits: usize) -> String {
    let whole = if number == 0.0 { 0 } else { number.abs().log10().floor() as i32 + 1 };
    let decimals = usize::try_from(i32::try_from(digits).unwrap_or_default() - whole).unwrap_or_default();
    let text = format!("{number:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(product: Product, known: &[(u8, i32)], units: Units) -> Shown {
        let known = known.to_vec();
        let find = move |number| known.iter().find(|(known, _)| *known == number).map(|(_, value)| *value);
        Shown::new(Some(product), &find, None, units).unwrap()
    }

    fn axis(number: u8, value: i32) -> Setting {
        Setting::Axis { number, axis: 0, value }
    }

    /// As `calc` has it: pulse divisor 3, so that an internal unit is 30.5 pps, and 51 200 microsteps a turn.
    #[test]
    fn physical_values_are_turns_and_milliamperes() {
        let shown = shown(Product::Tmcm1140, &[], Units::Physical);
        let told = |setting| format!("{} {}", shown.text(setting), shown.unit(setting));
        assert_eq!(told(axis(1, -25_600)), "-0.5 turns");
        assert_eq!(told(axis(4, 1678)), "1 turns/s");
        assert_eq!((told(axis(6, 255)), told(axis(6, 128))), ("2000 mA".into(), "1062.5 mA".into()));
        assert_eq!(told(axis(140, 8)), "8 ");
        assert_eq!(shown.number(axis(4, 0), "60 rpm"), Ok(1678));
        assert_eq!(shown.number(axis(4, 0), " 1 "), Ok(1678));
        assert_eq!(shown.number(axis(4, 0), "1 turns/s"), Ok(1678));
        assert_eq!(shown.number(axis(1, 0), "-0.5 turns"), Ok(-25_600));
        assert_eq!(shown.number(axis(6, 0), "1.2 A"), Ok(151));
        assert_eq!(shown.number(axis(4, 0), "0").unwrap_err(), "0 would be 0; maximum positioning speed takes 1..2047");
        assert!(shown.number(axis(4, 0), "fast").is_err() && shown.number(axis(4, 0), "1e300").is_err());
    }

    /// Whatever is shown is the same value again when it is typed.
    #[test]
    fn what_is_shown_can_be_typed() {
        for product in [Product::Tmcm1140, Product::Tmcm3212, Product::Tmcm6110] {
            let own = Units::Own { name: "mm".into(), microsteps: 12_800.0 };
            for units in [Units::Module, Units::Physical, own] {
                let shown = shown(product, &[], units.clone());
                for number in [1, 2, 3, 777, 2047] {
                    for setting in [axis(1, number * 1_000_003), axis(4, number), axis(5, number)] {
                        let text = shown.text(setting);
                        assert_eq!(shown.number(setting, &text), Ok(setting.value()), "{product:?} {units:?} {text}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_user_has_a_unit_of_his_own() {
        let units = |microsteps| Units::Own { name: "mm".into(), microsteps };
        let shown = shown(Product::Tmcm3212, &[(4, 5)], units(12_800.0));
        assert_eq!((shown.text(axis(4, 25_600)), shown.unit(axis(4, 0))), ("2".into(), "mm/s".into()));
        assert_eq!(shown.unit(axis(5, 0)), "mm/s2");
        let wrong = Shown::new(Some(Product::Tmcm3212), &|_| None, None, units(0.0));
        assert!(wrong.unwrap_err().contains("above zero"));
    }

    /// The divisors of an axis, its resolution and its motor count, and where there is a unit mode, that.
    #[test]
    fn the_values_of_the_axis_count() {
        let coarse = shown(Product::Tmcm1140, &[(140, 0)], Units::Physical);
        assert_eq!(coarse.text(axis(1, 100)), "0.5");
        let steps = Shown::new(Some(Product::Tmcm1140), &|_| None, Some(400), Units::Physical).unwrap();
        assert_eq!(steps.text(axis(1, 51_200)), "0.5");
        let told = shown(Product::Tmcm3212, &[(202, 400)], Units::Physical);
        assert_eq!(told.text(axis(1, 51_200)), "0.5");
        let chip = shown(Product::Tmcm3212, &[(255, 0)], Units::Module);
        assert_eq!((chip.unit(axis(4, 0)), chip.text(axis(4, 7))), ("chip".into(), "7".into()));
    }

    #[test]
    fn a_module_that_is_not_known_has_numbers() {
        let none = |units| Shown::new(None, &|_| None, None, units);
        assert!(none(Units::Physical).unwrap_err().contains("not known"));
        let shown = none(Units::Module).unwrap();
        assert_eq!((shown.text(axis(4, 7)), shown.unit(axis(4, 7))), ("7".into(), String::new()));
        assert_eq!((shown.number(axis(4, 0), "9999"), shown.number(axis(4, 0), "2 * 7")), (Ok(9999), Ok(14)));
        assert!(shown.number(axis(4, 0), "").is_err());
    }
}
