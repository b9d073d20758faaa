//! The columns: which parameters of an axis are sampled, and what they are called.

use tmcm::param::AxisParameter;

use crate::product::{Product, axis_number, numbers};

/// The parameters that are sampled unless others are wanted, each with its name.
const USUAL: [(AxisParameter, &str); 8] = [
    (AxisParameter::ActualPosition, "position"),
    (AxisParameter::ActualSpeed, "speed"),
    (AxisParameter::ActualLoad, "load"),
    (AxisParameter::DriverErrorFlags, "driver_flags"),
    (AxisParameter::ExtendedErrorFlags, "extended_flags"),
    (AxisParameter::LeftSwitch, "left_switch"),
    (AxisParameter::RightSwitch, "right_switch"),
    (AxisParameter::HomeSwitch, "home_switch"),
];

/// The values of the usual columns, in their order; `None` for a parameter that the module does not have.
pub type Usual = [Option<i32>; USUAL.len()];

/// A parameter that is sampled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Number of the axis parameter.
    pub number: u8,
    /// The name of the column in headlines and objects, without spaces.
    pub name: String,
}

/// The usual columns.
pub fn usual() -> Vec<Column> {
    let numbered = USUAL.iter().filter_map(|(parameter, name)| Some((axis_number(None, *parameter)?, *name)));
    numbered.map(|(number, name)| Column { number, name: name.into() }).collect()
}

/// The columns for parameters of a product by number, each once: with the usual names where there are such, else with
/// those that the product has for them.
pub(super) fn of(wanted: &[u8], product: Option<Product>) -> Vec<Column> {
    let mut columns: Vec<Column> = Vec::new();
    for &number in wanted {
        if columns.iter().any(|column| column.number == number) {
            continue;
        }
        let usual = usual().into_iter().find(|column| column.number == number);
        columns.push(usual.unwrap_or_else(|| Column { number, name: name(number, product) }));
    }
    columns
}

/// The name of a parameter in small letters, with underscores for what is neither letter nor digit.
fn name(number: u8, product: Option<Product>) -> String {
    let row = product.and_then(|product| numbers(Some(product)).axis.find(number));
    let Some(parameter) = row else { return format!("ap_{number}") };
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { ' ' };
    let words: String = parameter.row.name.chars().map(plain).collect();
    words.split_whitespace().collect::<Vec<_>>().join("_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_names_without_spaces() {
        let names =
            |wanted: &[u8], product| of(wanted, product).into_iter().map(|column| column.name).collect::<Vec<_>>();
        assert_eq!(names(&[206, 4, 206], Some(Product::Tmcm1140)), ["load", "maximum_positioning_speed"]);
        assert_eq!(names(&[1, 250], Some(Product::Tmcm1140)), ["position", "ap_250"]);
        assert_eq!(names(&[4], None), ["ap_4"]);
        assert_eq!(usual().len(), USUAL.len());
    }
}
