//! The parameters of a product's tables, one by one.

use tmcm::param::{AxisParameter, GlobalParameter, INTERRUPTS, Parameter, Row};

use super::file::Setting;
use super::place::INTERRUPTS as BANK_OF_INTERRUPTS;
use crate::product::{Product, axis_number, numbers, stores_axes};

/// A parameter of a table: where it is, its row, its name.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Where it is, with the value 0.
    pub setting: Setting,
    /// The row of the table about the parameter. Its number is that of the setting but for interrupts, where it is the
    /// first one's.
    pub row: &'static Row,
    /// The name of the parameter.
    pub name: String,
}

impl Entry {
    /// The parameters of an axis.
    pub fn of_axis(product: Option<Product>, axis: u8) -> impl Iterator<Item = Entry> {
        numbers(product).axis.rows.iter().map(move |Parameter { row, .. }| Entry {
            setting: Setting::Axis { number: row.number, axis, value: 0 },
            row,
            name: row.name.into(),
        })
    }

    /// The global parameters, of bank 0.
    pub fn globals(product: Option<Product>) -> impl Iterator<Item = Entry> {
        numbers(product).global.rows.iter().map(|Parameter { row, .. }| Entry {
            setting: Setting::Global { number: row.number, bank: 0, value: 0 },
            row,
            name: row.name.into(),
        })
    }

    /// The parameters of interrupts, of bank 3.
    pub fn interrupts(product: Option<Product>) -> impl Iterator<Item = Entry> {
        let spec = numbers(product);
        INTERRUPTS.iter().flat_map(|kind| {
            (0..kind.per.count(spec.axes, spec.inputs)).filter_map(|index| {
                let setting = Setting::Global { number: kind.number(index), bank: BANK_OF_INTERRUPTS, value: 0 };
                Some(Entry { setting, row: kind.row.as_ref()?, name: kind.parameter_name(index)?.to_string() })
            })
        })
    }

    /// True for a parameter that takes away what it tells: the extended error flags are cleared by reading them.
    pub fn clears(&self, product: Option<Product>) -> bool {
        let cleared = axis_number(product, AxisParameter::ExtendedErrorFlags);
        matches!(self.setting, Setting::Axis { number, .. } if cleared == Some(number))
    }

    /// True for a parameter that is as it was written, and no live value: it makes sense to compare it with its
    /// default.
    pub fn is_kept(&self, product: Option<Product>) -> bool {
        match self.setting {
            Setting::Axis { number, .. } => {
                numbers(product).axis.find(number).is_some_and(|found| is_axis_setting(found, product))
            }
            Setting::Global { number, bank: 0, .. } => {
                numbers(product).global.find(number).is_some_and(is_global_setting)
            }
            Setting::Global { .. } | Setting::Coordinate { .. } => self.row.writable(),
        }
    }
}

/// A parameter is a setting if it can be written and stored; the others are live values. Where axis parameters cannot
/// be stored, those that keep what is written are settings.
pub(super) fn is_axis_setting(found: &Parameter<AxisParameter>, product: Option<Product>) -> bool {
    let kept = match stores_axes(product) {
        true => found.row.stored(),
        false => found.function.index() < AxisParameter::SETTINGS,
    };
    found.row.writable() && kept
}

/// As [`is_axis_setting`] for a global parameter.
pub(super) fn is_global_setting(found: &Parameter<GlobalParameter>) -> bool {
    found.function != GlobalParameter::CodeProtection && found.row.writable() && found.row.stored()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_have_all_parameters_of_a_product() {
        let product = Some(Product::Tmcm3110);
        let axis: Vec<Entry> = Entry::of_axis(product, 2).collect();
        let clearing: Vec<u8> =
            axis.iter().filter(|entry| entry.clears(product)).map(|entry| entry.row.number).collect();
        assert_eq!(clearing, [207]);
        let kept = |number| axis.iter().find(|entry| entry.row.number == number).unwrap().is_kept(product);
        assert!(kept(4) && kept(6) && !kept(0) && !kept(1) && !kept(3));
        assert!(Entry::globals(product).all(|entry| matches!(entry.setting, Setting::Global { bank: 0, .. })));
        let names: Vec<String> = Entry::interrupts(product).map(|entry| entry.name).collect();
        assert!(names.contains(&"timer 0 period".into()) && names.contains(&"stop right 2 transition".into()));
        assert!(Entry::interrupts(product).all(|entry| entry.is_kept(product)));
    }
}
