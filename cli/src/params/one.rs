//! Reading and writing single parameters.

use std::io::Write;

use tmcm::param::STORED_USER_VARIABLES;
use tmcm::tmcl::Status;

use super::file::{Setting, VARIABLES};
use super::place::{self, Where};
use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::{Product, stores_axes};
use crate::tell;

/// Prints parameters: each as the line that a file of settings has, or as its value alone.
pub(super) fn get(module: &mut Conversation, names: &[String], at: Where, alone: bool) -> Result<(), Failure> {
    let product = place::product_for(module, names.iter().map(String::as_str))?;
    let settings = names.iter().map(|name| place::parse(name, at, product)).collect::<Result<Vec<_>, _>>();
    let settings = settings.map_err(Failure::Arguments)?;
    let product = if alone { product } else { module.product()? };
    let mut out = tell::out();
    let mut all_there = true;
    for setting in settings {
        match module.value(setting.read()) {
            Ok(value) if alone => writeln!(out, "{value}")?,
            Ok(value) => writeln!(out, "{}", setting.with(value).line(product))?,
            Err(error) if error.is_refusal() => {
                tell::error(error)?;
                all_there = false;
            }
            Err(error) => return Err(error.into()),
        }
    }
    if all_there { Ok(()) } else { Err(Failure::Reported) }
}

/// An assignment as the user has typed it: `NAME=VALUE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    name: String,
    value: String,
}

impl Assignment {
    /// Reads an assignment. Names and expressions are looked up later, when the product is known.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
                Ok(Assignment { name: name.trim().into(), value: value.trim().into() })
            }
            _ => Err("give a parameter and its value, for example APMaxCurrent=100 or 6=100".into()),
        }
    }
}

/// Writes parameters, with `store` into the EEPROM as well, and prints what was written. Nothing is written unless all
/// names and values make sense.
pub(super) fn set(
    module: &mut Conversation,
    assignments: &[Assignment],
    at: Where,
    store: bool,
) -> Result<(), Failure> {
    let texts = assignments.iter().flat_map(|assignment| [assignment.name.as_str(), assignment.value.as_str()]);
    let named = place::product_for(module, texts)?;
    let read = |assignment: &Assignment| {
        let setting = place::parse(&assignment.name, at, named)?;
        Ok(setting.with(place::value(&assignment.value, named)?))
    };
    let settings = assignments.iter().map(read).collect::<Result<Vec<_>, _>>().map_err(Failure::Arguments)?;
    let product = module.product()?;
    if store {
        settings.iter().try_for_each(|setting| storable(*setting, product)).map_err(Failure::Failed)?;
    }
    let mut out = tell::out();
    let mut all_done = true;
    for setting in settings {
        match write(module, setting, product, store) {
            Ok(()) => writeln!(out, "{}", setting.line(product))?,
            Err(error) if error.is_refusal() => {
                tell::error(format_args!("{error}{}", hint(&error, setting, product)))?;
                all_done = false;
            }
            Err(error) => return Err(error.into()),
        }
    }
    if all_done { Ok(()) } else { Err(Failure::Reported) }
}

fn write(module: &mut Conversation, setting: Setting, product: Option<Product>, store: bool) -> Result<(), Error> {
    module.request(setting.write())?;
    if let Some(command) = setting.store(product).filter(|_| store) {
        module.request(command)?;
    }
    Ok(())
}

/// What a parameter takes, behind the refusal of a value.
fn hint(error: &Error, setting: Setting, product: Option<Product>) -> String {
    let row = setting.row(product).filter(|row| error.is(Status::InvalidValue) && !row.accepts(setting.value()));
    row.map_or_else(String::new, |row| format!("; {} takes {}", row.name, super::list::range(row)))
}

/// Fails for a parameter that the product cannot store.
fn storable(setting: Setting, product: Option<Product>) -> Result<(), String> {
    let name = setting.row(product).map_or_else(|| setting.read().to_string(), |row| row.name.into());
    match setting {
        Setting::Global { bank: VARIABLES, number, .. } if usize::from(number) >= STORED_USER_VARIABLES => {
            let last = STORED_USER_VARIABLES - 1;
            Err(format!("{name}: only user variables 0 to {last} can be stored; leave out --store"))
        }
        Setting::Global { bank: 0 | VARIABLES, .. } => Ok(()),
        Setting::Global { bank, .. } => {
            Err(format!("{name}: parameters of bank {bank} cannot be stored; leave out --store"))
        }
        Setting::Axis { .. } if !stores_axes(product) => Err(format!(
            "{name}: this module does not store parameters of its axes; leave out --store, and keep them in a file (tmcl \
             params LINK save FILE)"
        )),
        _ if setting.row(product).is_some_and(|row| !row.stored()) => {
            Err(format!("{name}: this parameter cannot be stored; leave out --store"))
        }
        _ => Ok(()),
    }
}
