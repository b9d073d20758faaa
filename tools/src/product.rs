//! The products that the tools know, by name, and what their tables say about numbers.
//!
//! Where the product of a module is unknown, it is `None` here: values are shown as numbers then.

use tmcm::module::Spec;
use tmcm::param::{AxisParameter, GlobalParameter, Unit};
use tmcm::tmcl::{Command, Opcode};
pub use tmcm_sim::Product;
use tmcm_sim::suggest::suggestion;
pub use tmcm_sim::wire::names::{parameter, speed_unit, symbol, with_unit};

/// The product that programs are for, and that virtual modules are, unless the user names another one.
pub const USUAL: &str = "1140";

/// Reads the name of a product, such as `6110` or `TMCM-6110`; capitals and small letters are the same.
///
/// # Errors
/// A message that lists the known names.
pub fn named(text: &str) -> Result<Product, String> {
    Product::named(text).ok_or_else(|| {
        let names = Product::ALL.map(short);
        let meant = text.to_ascii_uppercase();
        let suggestion = suggestion(meant.trim_start_matches("TMCM").trim_start_matches('-'), names.into_iter());
        format!("'{text}' is none of {}{suggestion}", names.join(", "))
    })
}

/// A text of the help with the products in the places that it has for them: `{numbers}` and `{names}` are the short and
/// the full names, with "or" before the last one, `{all}` the full names with commas alone.
pub fn told(text: &str) -> String {
    let [numbers, names] = [Product::ALL.map(short), Product::ALL.map(Product::name)];
    text.replace("{numbers}", &one_of(&numbers)).replace("{names}", &one_of(&names)).replace("{all}", &names.join(", "))
}

/// A list with "or" before its last word.
fn one_of(words: &[&str]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => words.concat(),
    }
}

/// The short name of a product, such as `6110`.
pub fn short(product: Product) -> &'static str {
    product.name().trim_start_matches("TMCM-")
}

/// The tables with the numbers of a product. A product that is not known is taken to have the numbers that all known
/// ones share with the TMCM-1140.
pub fn numbers(product: Option<Product>) -> &'static Spec {
    product.unwrap_or_default().spec()
}

/// The unit of speeds on a product in words.
pub fn speed_words(product: Product) -> &'static str {
    match speed_unit(product) {
        Unit::Internal => "internal units",
        unit => unit.symbol(),
    }
}

/// The command that reads the unit mode of an axis, on products that have one. An axis whose mode is 0 has its speeds
/// and accelerations in units of its chip.
pub fn read_unit_mode(product: Option<Product>, axis: u8) -> Option<Command> {
    let number = product.and_then(|product| axis_number(Some(product), AxisParameter::UnitMode))?;
    Some(Command::new(Opcode::Gap as u8, number, axis, 0))
}

/// True for a product that stores axis parameters, as those do that are not known.
pub fn stores_axes(product: Option<Product>) -> bool {
    !numbers(product).lacks.contains(&Opcode::Stap)
}

/// The number of an axis parameter, if the product has it.
pub fn axis_number(product: Option<Product>, parameter: AxisParameter) -> Option<u8> {
    numbers(product).axis.row(parameter).map(|row| row.number)
}

/// The number of a global parameter, if the product has it.
pub fn global_number(product: Option<Product>, parameter: GlobalParameter) -> Option<u8> {
    numbers(product).global.row(parameter).map(|row| row.number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_every_form() {
        for text in ["6110", "TMCM-6110", "tmcm-6110"] {
            assert_eq!(named(text), Ok(Product::Tmcm6110), "{text}");
        }
        assert_eq!(named(USUAL), Ok(Product::default()));
    }

    #[test]
    fn the_help_lists_all_products() {
        assert_eq!(
            told("of {numbers}; {all}"),
            "of 1140, 1110, 3110, 3212 or 6110; TMCM-1140, TMCM-1110, TMCM-3110, TMCM-3212, TMCM-6110"
        );
        assert_eq!(told("a {names} or so"), "a TMCM-1140, TMCM-1110, TMCM-3110, TMCM-3212 or TMCM-6110 or so");
    }

    #[test]
    fn an_unknown_name_is_answered_with_those_there_are() {
        let error = |text| named(text).unwrap_err();
        assert_eq!(error("9999"), "'9999' is none of 1140, 1110, 3110, 3212, 6110");
        assert_eq!(error("6111"), "'6111' is none of 1140, 1110, 3110, 3212, 6110; did you mean '6110'?");
        assert!(error("tmcm3111").ends_with("did you mean '3110'?"));
    }

    /// A parameter of which the tools make use has the same number on all products that have it.
    #[test]
    fn products_share_their_numbers() {
        use AxisParameter as P;
        let used = [
            P::ActualPosition,
            P::ActualSpeed,
            P::ActualLoad,
            P::DriverErrorFlags,
            P::ExtendedErrorFlags,
            P::LeftSwitch,
            P::RightSwitch,
            P::HomeSwitch,
        ];
        for spec in Product::ALL.map(Product::spec) {
            for parameter in used {
                let number = spec.axis.row(parameter).map(|row| row.number);
                assert!(number.is_none() || number == axis_number(None, parameter), "{parameter:?}");
            }
            for parameter in [GlobalParameter::AutoStart, GlobalParameter::CodeProtection] {
                assert_eq!(spec.global.row(parameter).map(|row| row.number), global_number(None, parameter));
            }
        }
    }
}
