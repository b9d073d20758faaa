//! Reading and writing single parameters.

use std::io::Write;

use tmcl_tools::conversation::Conversation;
use tmcl_tools::params::{Assignment, Where, hint, parse, product_for, storable, write};

use crate::failure::Failure;
use crate::tell;

/// Prints parameters: each as the line that a file of settings has, or as its value alone.
pub(super) fn get(module: &mut Conversation, names: &[String], at: Where, alone: bool) -> Result<(), Failure> {
    let product = product_for(module, names.iter().map(String::as_str))?;
    let settings = names.iter().map(|name| parse(name, at, product)).collect::<Result<Vec<_>, _>>();
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

/// Writes parameters, with `store` into the EEPROM as well, and prints what was written. Nothing is written unless all
/// names and values make sense.
pub(super) fn set(
    module: &mut Conversation,
    assignments: &[Assignment],
    at: Where,
    store: bool,
) -> Result<(), Failure> {
    let named = product_for(module, assignments.iter().flat_map(Assignment::texts))?;
    let settings = assignments
        .iter()
        .map(|assignment| assignment.setting(at, named))
        .collect::<Result<Vec<_>, _>>()
        .map_err(Failure::Arguments)?;
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
