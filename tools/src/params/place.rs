//! The parameter that a user means: by a name of the assembler, or by its number with an axis or a bank.

use super::file::Setting;
use crate::asm;
use crate::conversation::{Conversation, Error};
use crate::product::Product;

/// Bank of the parameters of interrupts.
pub const INTERRUPTS: u8 = 3;

/// The axis or the bank that is meant, from the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Where {
    /// The axis, if one was given.
    pub axis: Option<u8>,
    /// The bank, if one was given.
    pub bank: Option<u8>,
}

/// The family of a parameter, as the beginning of its name tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    Axis,
    Bank(u8),
}

impl Family {
    /// The family of the first name in an expression; `None` for plain numbers.
    fn of(text: &str) -> Option<Self> {
        let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        words.map(str::to_ascii_uppercase).find_map(|word| match word {
            word if word.starts_with("AP") => Some(Family::Axis),
            word if word.starts_with("GP") => Some(Family::Bank(0)),
            word if word.starts_with("TI_") => Some(Family::Bank(INTERRUPTS)),
            _ => None,
        })
    }
}

/// The parameter that `text` names, with the value 0.
///
/// # Errors
/// What is wrong with the text, or how it contradicts the axis or the bank.
pub fn parse(text: &str, at: Where, product: Option<Product>) -> Result<Setting, String> {
    let number = asm::value(text, product, &asm::Symbols::default()).map_err(|error| format!("'{text}': {error}"))?;
    let number =
        u8::try_from(number).map_err(|_| format!("'{text}': {number} is no parameter; their numbers are 0 to 255"))?;
    let Where { axis, bank } = at;
    match (Family::of(text), axis, bank) {
        (_, Some(_), Some(_)) => Err("a parameter has an axis or a bank; leave out --axis or --bank".into()),
        (Some(Family::Axis), _, Some(_)) => Err(format!("'{text}' is a parameter of an axis; leave out --bank")),
        (Some(Family::Bank(own)), Some(_), None) => {
            Err(format!("'{text}' is a global parameter, of bank {own}; leave out --axis"))
        }
        (Some(Family::Bank(own)), None, Some(bank)) if own != bank => {
            Err(format!("'{text}' is a parameter of bank {own}; leave out --bank"))
        }
        (Some(Family::Bank(bank)), None, _) | (None, None, Some(bank)) => {
            Ok(Setting::Global { number, bank, value: 0 })
        }
        (Some(Family::Axis) | None, axis, None) => Ok(Setting::Axis { number, axis: axis.unwrap_or(0), value: 0 }),
    }
}

/// The value that `text` is, as a parameter takes it: numbers above 2147483647 are those that are negative with a sign.
///
/// # Errors
/// What is wrong with the text.
pub(super) fn value(text: &str, product: Option<Product>) -> Result<i32, String> {
    let value = asm::value(text, product, &asm::Symbols::default()).map_err(|error| format!("'{text}': {error}"))?;
    i32::try_from(value)
        .or_else(|_| u32::try_from(value).map(u32::cast_signed))
        .map_err(|_| format!("'{text}': {value} does not fit 32 bits"))
}

/// The product that the names in these texts are of. A module is not asked for numbers alone.
pub fn product_for<'a>(
    module: &mut Conversation,
    mut texts: impl Iterator<Item = &'a str>,
) -> Result<Option<Product>, Error> {
    let has_names = |text: &str| asm::value(text, None, &asm::Symbols::default()).is_err();
    Ok(if texts.any(has_names) { module.product()? } else { None })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRODUCT: Option<Product> = Some(Product::Tmcm1140);

    fn at(axis: Option<u8>, bank: Option<u8>) -> Where {
        Where { axis, bank }
    }

    #[test]
    fn names_tell_what_they_are_and_numbers_where_they_are() {
        let nowhere = Where::default();
        for (text, place, expected) in [
            ("4", nowhere, Setting::Axis { number: 4, axis: 0, value: 0 }),
            ("4", at(Some(2), None), Setting::Axis { number: 4, axis: 2, value: 0 }),
            ("apMaxPositioningSpeed", at(Some(1), None), Setting::Axis { number: 4, axis: 1, value: 0 }),
            ("APMaxPositioningSpeed + 2", nowhere, Setting::Axis { number: 6, axis: 0, value: 0 }),
            ("GPSerialAddress", nowhere, Setting::Global { number: 66, bank: 0, value: 0 }),
            ("GPSerialAddress", at(None, Some(0)), Setting::Global { number: 66, bank: 0, value: 0 }),
            ("TI_INPUT0", nowhere, Setting::Global { number: 39, bank: 3, value: 0 }),
            ("$10", at(None, Some(2)), Setting::Global { number: 16, bank: 2, value: 0 }),
        ] {
            assert_eq!(parse(text, place, PRODUCT), Ok(expected), "{text}");
        }
        for (text, place, expected) in [
            ("APMaxCurrent", at(None, Some(0)), "'APMaxCurrent' is a parameter of an axis; leave out --bank"),
            ("GPCanId", at(Some(0), None), "'GPCanId' is a global parameter, of bank 0; leave out --axis"),
            ("GPCanId", at(None, Some(3)), "'GPCanId' is a parameter of bank 0; leave out --bank"),
            ("256", nowhere, "'256': 256 is no parameter; their numbers are 0 to 255"),
            ("APMaxCurent", nowhere, "'APMaxCurent': unknown name 'APMaxCurent'; did you mean 'APMaxCurrent'?"),
        ] {
            assert_eq!(parse(text, place, PRODUCT), Err(expected.into()));
        }
    }

    #[test]
    fn values_are_of_32_bits_with_or_without_a_sign() {
        assert_eq!(value("3 * 500", None), Ok(1500));
        assert_eq!((value("$FFFFFFFF", None), value("-2147483648", None)), (Ok(-1), Ok(i32::MIN)));
        assert!(value("4294967296", None).is_err() && value("", None).is_err() && value("x", None).is_err());
    }
}
