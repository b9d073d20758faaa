//! Assignments: parameters and the values that they are to have.

use tmcm::param::STORED_USER_VARIABLES;
use tmcm::tmcl::Status;

use super::file::{Setting, VARIABLES};
use super::list::range;
use super::place::{self, Where};
use crate::conversation::{Conversation, Error};
use crate::product::{Product, stores_axes};

/// An assignment as the user has typed it: `NAME=VALUE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    name: String,
    value: String,
}

impl Assignment {
    /// Reads an assignment. Names and expressions are looked up later, when the product is known.
    ///
    /// # Errors
    /// A message with an example.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
                Ok(Assignment { name: name.trim().into(), value: value.trim().into() })
            }
            _ => Err("give a parameter and its value, for example APMaxCurrent=100 or 6=100".into()),
        }
    }

    /// The texts in which there may be names.
    pub fn texts(&self) -> [&str; 2] {
        [&self.name, &self.value]
    }

    /// The setting that is meant, with its value, of a product whose names it may have.
    ///
    /// # Errors
    /// What is wrong with the name or with the value.
    pub fn setting(&self, at: Where, product: Option<Product>) -> Result<Setting, String> {
        let setting = place::parse(&self.name, at, product)?;
        Ok(setting.with(place::value(&self.value, product)?))
    }
}

/// Writes a setting, with `store` into the EEPROM as well.
///
/// # Errors
/// The module refuses it, or the link fails.
pub fn write(module: &mut Conversation, setting: Setting, product: Option<Product>, store: bool) -> Result<(), Error> {
    module.request(setting.write())?;
    if let Some(command) = setting.store(product).filter(|_| store) {
        module.request(command)?;
    }
    Ok(())
}

/// Tells what a parameter takes, behind the refusal of a value.
pub fn hint(error: &Error, setting: Setting, product: Option<Product>) -> String {
    let row = setting.row(product).filter(|row| error.is(Status::InvalidValue) && !row.accepts(setting.value()));
    row.map_or_else(String::new, |row| format!("; {} takes {}", row.name, range(row)))
}

/// Why a setting cannot be stored on command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unstored {
    /// Only the first user variables can be.
    Variable,
    /// No parameters of this bank can be.
    Bank(u8),
    /// The product does not store parameters of its axes.
    Axes,
    /// The parameter has no place in the EEPROM.
    Volatile,
}

/// Why a product cannot store a setting; `None` if it can.
pub fn unstored(setting: Setting, product: Option<Product>) -> Option<Unstored> {
    match setting {
        Setting::Global { bank: VARIABLES, number, .. } if usize::from(number) >= STORED_USER_VARIABLES => {
            Some(Unstored::Variable)
        }
        Setting::Global { bank: 0 | VARIABLES, .. } => None,
        Setting::Global { bank, .. } => Some(Unstored::Bank(bank)),
        Setting::Axis { .. } if !stores_axes(product) => Some(Unstored::Axes),
        _ if setting.row(product).is_some_and(|row| !row.stored()) => Some(Unstored::Volatile),
        _ => None,
    }
}

/// Fails for a parameter that the product cannot store.
///
/// # Errors
/// The message for the user.
pub fn storable(setting: Setting, product: Option<Product>) -> Result<(), String> {
    let name = setting.row(product).map_or_else(|| setting.read().to_string(), |row| row.name.into());
    let Some(unstored) = unstored(setting, product) else { return Ok(()) };
    Err(match unstored {
        Unstored::Variable => {
            let last = STORED_USER_VARIABLES - 1;
            format!("{name}: only user variables 0 to {last} can be stored; leave out --store")
        }
        Unstored::Bank(bank) => format!("{name}: parameters of bank {bank} cannot be stored; leave out --store"),
        Unstored::Axes => format!(
            "{name}: this module does not store parameters of its axes; leave out --store, and keep them in a file (tmcl \
             params LINK save FILE)"
        ),
        Unstored::Volatile => format!("{name}: this parameter cannot be stored; leave out --store"),
    })
}
