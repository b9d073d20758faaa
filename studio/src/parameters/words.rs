//! Sentences that have to be known before something is written or stored.

use tmcl_tools::asm::Symbols;
use tmcl_tools::params::{Entry, Lasting, Setting, Unstored, VARIABLES, range, stores_itself, unstored};
use tmcl_tools::product::stores_axes;
use tmcl_tools::request::Request;
use tmcm::param::{STORED_USER_VARIABLES, Storage};
use tmcm_sim::Product;

use super::types::{ParameterPlace, ParameterWords, ParameterWrites, ParametersStore, ParametersToWrite, TypedLine};
use crate::stop::known;

/// The warning that the EEPROM wears.
const WEARS: &str = "The EEPROM wears with each write: store what is to stay, and not what is only tried.";
/// The warning of what the factory settings take away.
const DEFAULTS: &str = "All settings that are stored in the EEPROM of the module are lost, those of its interfaces, too: it \
                        has its factory settings after the next reset, and may have to be connected anew.";
/// The warning of what is lost by storing coordinates.
const COORDINATES: &str = "The coordinates that are stored in the EEPROM of the module are lost.";
/// The warning of what a setting of an interface does.
const CUTS_OFF: &str = "The module may not answer any more over this link after that, and has to be connected anew.";

/// A setting in words.
fn name(setting: Setting, product: Option<Product>) -> String {
    let axis = |axis: u8| match product {
        Some(product) if product.spec().axes == 1 => String::new(),
        _ => format!(" of axis {axis}"),
    };
    match (setting, setting.row(product)) {
        (Setting::Axis { axis: of, .. }, Some(row)) => format!("{}{}", row.name, axis(of)),
        (Setting::Axis { number, axis: of, .. }, None) => format!("axis parameter {number}{}", axis(of)),
        (Setting::Coordinate { number, axis: of, .. }, _) => format!("coordinate {number}{}", axis(of)),
        (Setting::Global { .. }, Some(row)) => row.name.into(),
        (Setting::Global { number, bank: VARIABLES, .. }, None) => format!("user variable {number}"),
        (Setting::Global { number, bank, .. }, None) => {
            let found = Entry::interrupts(product).find(|entry| entry.setting.is_same(setting));
            found.map_or_else(|| format!("global parameter {number} of bank {bank}"), |entry| entry.name)
        }
    }
}

/// A line of a file in words, and why a product will not take it.
pub(super) fn in_file(setting: Setting, product: Option<Product>) -> (String, String) {
    let why = match (setting, setting.row(product), product) {
        (Setting::Axis { axis, .. } | Setting::Coordinate { axis, .. }, _, Some(product))
            if axis >= product.spec().axes =>
        {
            format!("a {} has no axis {axis}", product.name())
        }
        (Setting::Axis { .. } | Setting::Global { bank: 0, .. }, None, Some(product)) => {
            format!("a {} has no such parameter", product.name())
        }
        (_, Some(row), _) if !row.writable() => "it can only be read".into(),
        (_, Some(row), _) if !row.accepts(setting.value()) => format!("it takes {}", range(row)),
        _ => String::new(),
    };
    (name(setting, product), why)
}

/// A number of things in words.
fn count(number: usize, one: &str, many: &str) -> String {
    if number == 1 { format!("1 {one}") } else { format!("{number} {many}") }
}

/// The warning of what is lost by storing one parameter.
fn overwritten(setting: Setting, product: Option<Product>) -> String {
    format!("The value of {} that is stored in the EEPROM of the module is lost.", name(setting, product))
}

/// The warning of a parameter that the module stores by itself.
fn stored_at_once(setting: Setting, product: Option<Product>) -> String {
    let (name, value) = (name(setting, product), setting.value());
    format!("{name}: the module stores {value} by itself at once, and what is stored there now is lost.")
}

/// Tells what storing parameters takes.
pub fn writes(ParametersStore { product, axes, of }: &ParametersStore) -> ParameterWrites {
    let product = known(product.as_deref());
    let settings: Vec<Setting> = match of {
        Some(of) => of.iter().map(|place| place.with(0)).collect(),
        None => {
            let entries = (0..*axes).flat_map(|axis| Entry::of_axis(product, axis)).chain(Entry::globals(product));
            let entries = entries.filter(|entry| matches!(entry.row.storage, Storage::OnCommand(_)));
            entries.map(|entry| entry.setting).collect()
        }
    };
    let stored = |setting: &Setting| setting.store(product).is_some() && unstored(*setting, product).is_none();
    let stores: Vec<Setting> = settings.iter().copied().filter(stored).collect();
    let number = stores.len();
    let lines = if let [one] = stores.as_slice() {
        vec![overwritten(*one, product), WEARS.into()]
    } else if number > 0 {
        vec![
            format!(
                "The values of {} that are stored in the EEPROM of the module are lost.",
                count(number, "parameter", "parameters")
            ),
            format!("That takes {}. {WEARS}", count(number, "write to the EEPROM", "writes to the EEPROM")),
        ]
    } else if !stores_axes(product) {
        vec!["This module does not store parameters of its axes: keep them in a file.".into()]
    } else {
        vec![match settings.first().and_then(|setting| unstored(*setting, product)) {
            Some(Unstored::Variable) => format!("Only the first {STORED_USER_VARIABLES} user variables can be stored."),
            Some(_) => "This parameter cannot be stored.".into(),
            None => "There is nothing to be stored: the module stores global parameters when they are written.".into(),
        }]
    };
    ParameterWrites { of: stores.into_iter().filter_map(ParameterPlace::of).collect(), writes: number, lines }
}

/// Tells what has to be known before values are written: which the module stores by itself, and which may cut it off.
pub fn automatic(ParametersToWrite { product, to }: &ParametersToWrite) -> ParameterWords {
    let product = known(product.as_deref());
    let settings: Vec<Setting> = to.iter().map(super::ParameterSetting::setting).collect();
    let stored: Vec<Setting> = settings.into_iter().filter(|setting| stores_itself(*setting, product)).collect();
    let mut lines: Vec<String> = stored.iter().map(|setting| stored_at_once(*setting, product)).collect();
    if stored.iter().any(|setting| setting.is_interface(product)) {
        lines.push(CUTS_OFF.into());
    }
    ParameterWords { lines }
}

/// Tells what has to be known before a line of direct mode is sent: what it leaves in the EEPROM. There is nothing to
/// know of a line that is no command; that is told when it is sent.
pub fn typed(TypedLine { line, product }: &TypedLine) -> ParameterWords {
    let product = known(product.as_deref());
    let request = Request::read(line, product, &Symbols::default()).ok();
    let lines = match request.and_then(|request| Lasting::of(request.command, product)) {
        None => Vec::new(),
        Some(Lasting::Stored(setting)) => vec![overwritten(setting, product), WEARS.into()],
        Some(Lasting::ByItself(setting)) => {
            let cuts_off = setting.is_interface(product).then(|| CUTS_OFF.into());
            [stored_at_once(setting, product)].into_iter().chain(cuts_off).collect()
        }
        Some(Lasting::Coordinates) => vec![COORDINATES.into(), WEARS.into()],
        Some(Lasting::Defaults) => vec![DEFAULTS.into()],
    };
    ParameterWords { lines }
}
