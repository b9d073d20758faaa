//! The current of a motor as a user writes it, and as it is shown.

use super::current::{EACH, FULL, STEPS, make, possible};
use super::exact::Exact;
use super::value::{self, Meaning};
use crate::product::Product;

/// The currents of a product.
#[derive(Clone, Copy, Debug)]
pub struct Current(Product);

impl Current {
    /// The unit of what is shown, and of what is typed without one.
    pub const UNIT: &str = "mA";

    /// The currents of this product.
    pub fn of(product: Product) -> Self {
        Current(product)
    }

    /// The current that a number of a parameter gives the coils, in mA RMS.
    pub fn shown(self, number: i32) -> f64 {
        let step = (i128::from(number).clamp(0, FULL) / EACH) + 1;
        Exact::ratio(i128::from(self.0.kind().full_current) * step, STEPS).approximate()
    }

    /// The number of a current as a user writes it: `1.2 A`, or without a unit in mA.
    ///
    /// # Errors
    /// A message about what is no current of the product.
    pub fn number(self, text: &str) -> Result<i32, String> {
        let alone = text.trim().bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte));
        let text = if alone { format!("{} {}", text.trim(), Self::UNIT) } else { text.trim().to_owned() };
        let values = value::read(self.0.spec(), std::slice::from_ref(&text))?;
        let found = values.first().filter(|_| values.len() == 1).and_then(|value| {
            value.meanings.iter().find_map(|meaning| match meaning {
                Meaning::Current(amperes) => Some(value.number * *amperes),
                _ => None,
            })
        });
        let wanted = found.ok_or_else(|| format!("{text}: that is no current; write for example 1.2 A"))?;
        possible(self.0, &text, wanted)?;
        let number = make(self.0.kind().full_current, wanted).number;
        i32::try_from(number).map_err(|_| format!("{text}: that is no number of a current"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of 1.1 A of a TMCM-6110 is 16 of 32 steps, of which 120 to 127 are the last.
    #[test]
    fn a_current_is_shown_and_typed() {
        let current = Current::of(Product::Tmcm6110);
        assert_eq!((current.shown(127), current.shown(128), current.shown(255)), (550.0, 584.375, 1100.0));
        assert_eq!(
            (current.number("550"), current.number(" 0.55 A"), current.number("550 mA")),
            (Ok(127), Ok(127), Ok(127))
        );
        assert_eq!(current.number("2 A").unwrap_err(), "2 A: a current of a TMCM-6110 is at most 1.1 A");
        assert_eq!(current.number("60 rpm").unwrap_err(), "60 rpm: that is no current; write for example 1.2 A");
        assert!(current.number("").is_err() && current.number("-1").is_err() && current.number("1 A 2 A").is_err());
    }
}
