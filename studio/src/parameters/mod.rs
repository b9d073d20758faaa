//! Parameters: their tables, their values in the module, and files of them.
//!
//! * [`types`] - what is asked, and what is told
//! * [`view`] - how values are shown and typed
//! * [`words`] - what has to be known before something is written or stored

pub mod types;
pub mod view;
pub mod words;

use tmcl_tools::failure::Failure;
use tmcl_tools::params::{
    self, Each, Entry, Settings, Shown, Units, Wanted, check_number, range, read_each, store_each, write_each,
};
use tmcl_tools::product::symbol;
use tmcl_tools::progress::Progress;
use tmcm::param::{GlobalParameter, Storage};
use tmcm_sim::Product;

use self::types::{
    ParameterBank, ParameterLine, ParameterLines, ParameterPlace, ParameterRange, ParameterRow, ParameterSetting,
    ParameterStored, ParameterTables, ParameterTold, ParametersFile, ParametersMeant, ParametersOf, ParametersRestore,
    ParametersTold, ParametersWrite,
};
use self::view::{
    OwnUnit, ParameterText, ParameterTexts, ParameterTyped, ParameterUnits, ParameterView, ParametersShow,
};
use crate::stop::{axes, known};
use crate::tools::{Tools, failed};
use crate::types::Value;

/// The tables of a product.
pub fn tables(ParametersOf { product }: &ParametersOf) -> ParameterTables {
    let product = known(product.as_deref());
    let entries = Entry::of_axis(product, 0).chain(Entry::globals(product)).chain(Entry::interrupts(product));
    ParameterTables { axes: axes(product), rows: entries.filter_map(|entry| row(&entry, product)).collect() }
}

fn row(entry: &Entry, product: Option<Product>) -> Option<ParameterRow> {
    let Entry { setting, row, name } = entry;
    let ParameterPlace { bank, number, .. } = ParameterPlace::of(*setting)?;
    let ranges = row.ranges.iter().map(|&(low, high)| ParameterRange { low, high }).collect();
    Some(ParameterRow {
        bank,
        number,
        name: name.clone(),
        unit: symbol(row.unit, false).into(),
        ranges,
        takes: range(row),
        default: row.default,
        writable: row.writable(),
        stored: match row.storage {
            Storage::Volatile => ParameterStored::No,
            Storage::OnCommand(_) => ParameterStored::Command,
            Storage::Automatic(_) => ParameterStored::Automatic,
        },
        kept: entry.is_kept(product),
        clears: entry.clears(product),
        note: row.note.into(),
    })
}

/// Reads a file of `tmcl params`.
///
/// # Errors
/// It is none, or one of another product; the words name the line.
pub fn file(ParametersFile { name, text, product }: &ParametersFile) -> Result<ParameterLines, Failure> {
    let product = known(product.as_deref());
    let Settings { product: from, list } = Settings::parse(name, text).map_err(Failure::Failed)?;
    if let Some(product) = product {
        check_number(product.spec().number, from, name).map_err(Failure::Failed)?;
    }
    let last = |index: usize| {
        let (setting, later) = (list.get(index)?, list.get(index + 1..)?);
        (!later.iter().any(|other| other.is_same(*setting))).then_some(*setting)
    };
    let lines = (0..list.len()).filter_map(last).filter_map(|setting| {
        let place = ParameterPlace::of(setting)?;
        let (name, why) = words::in_file(setting, product);
        Some(ParameterLine { place, value: setting.value(), name, interface: setting.is_interface(product), why })
    });
    Ok(ParameterLines { from, lines: lines.collect() })
}

fn shown(ParameterView { product, known: values, steps, units }: &ParameterView) -> Result<Shown, Failure> {
    let value = |number| {
        let found = values.iter().find(|known| known.place.bank == ParameterBank::Axis && known.place.number == number);
        found.map(|known| known.value)
    };
    let units = match units {
        ParameterUnits::Module => Units::Module,
        ParameterUnits::Physical => Units::Physical,
        ParameterUnits::Own(OwnUnit { name, microsteps }) => Units::Own { name: name.clone(), microsteps: *microsteps },
    };
    Shown::new(known(product.as_deref()), &value, *steps, units).map_err(Failure::Failed)
}

/// Values as they are shown.
///
/// # Errors
/// The product is not known, and its units neither; or a unit of the user's is none.
pub fn texts(ParametersShow { view, settings }: &ParametersShow) -> Result<ParameterTexts, Failure> {
    let shown = shown(view)?;
    let text = |setting: &ParameterSetting| {
        let setting = setting.setting();
        ParameterText { text: shown.text(setting), unit: shown.unit(setting) }
    };
    Ok(ParameterTexts { texts: settings.iter().map(text).collect() })
}

/// The value that was typed.
///
/// # Errors
/// It is none, or not one that the parameter takes.
pub fn number(ParameterTyped { view, place, text }: &ParameterTyped) -> Result<Value, Failure> {
    let value = shown(view)?.number(place.with(0), text).map_err(Failure::Failed)?;
    Ok(Value { value: Some(value) })
}

/// Tells what has become of parameters, with the values that are told.
fn told<T>(
    of: impl Iterator<Item = ParameterPlace>,
    each: Each<T>,
    value: impl Fn(T) -> Option<i32>,
) -> ParametersTold {
    let told = of.zip(each).map(|(place, told)| match told {
        Ok(told) => ParameterTold { place, value: value(told), why: String::new() },
        Err(refusal) => ParameterTold { place, value: None, why: refusal.to_string() },
    });
    ParametersTold { told: told.collect() }
}

impl Tools {
    /// Reads parameters.
    ///
    /// # Errors
    /// The link fails, or it has been asked to end.
    pub fn read_parameters(
        &mut self,
        ParametersMeant { of }: &ParametersMeant,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<ParametersTold, Failure> {
        let settings: Vec<_> = of.iter().map(|place| place.with(0)).collect();
        let each = read_each(&mut self.module, &settings, &self.stop, progress)?;
        Ok(told(of.iter().copied(), each, Some))
    }

    /// Writes parameters, each as it is asked.
    ///
    /// # Errors
    /// The link fails, or it has been asked to end.
    pub fn write_parameters(
        &mut self,
        ParametersWrite { to, store }: &ParametersWrite,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<ParametersTold, Failure> {
        let product = self.module.product().map_err(failed)?;
        let settings: Vec<_> = to.iter().map(ParameterSetting::setting).collect();
        let each = write_each(&mut self.module, &settings, product, *store, &self.stop, progress)?;
        Ok(told(to.iter().map(|to| to.place), each, Some))
    }

    /// Stores parameters with the values that they have, as far as they are stored on command.
    ///
    /// # Errors
    /// The link fails, or it has been asked to end.
    pub fn store_parameters(
        &mut self,
        ParametersMeant { of }: &ParametersMeant,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<ParametersTold, Failure> {
        let product = self.module.product().map_err(failed)?;
        let settings: Vec<_> = of.iter().map(|place| place.with(0)).collect();
        let each = store_each(&mut self.module, &settings, product, &self.stop, progress)?;
        Ok(told(of.iter().copied(), each, |()| None))
    }

    /// Writes lines of a file, as `tmcl params restore` does: at standstill, and again what depends on a later line.
    /// The values are not read back.
    ///
    /// # Errors
    /// The module is another product than the file's, a motor turns, the link fails, or it has been asked to end.
    pub fn restore_parameters(
        &mut self,
        ParametersRestore { name, from, to, store }: &ParametersRestore,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<ParametersTold, Failure> {
        let identity = self.module.identity().map_err(failed)?;
        check_number(identity.number, *from, name).map_err(Failure::Failed)?;
        let settings = to.iter().map(ParameterSetting::setting).collect();
        // Those of the interfaces have been ticked.
        let wanted = Wanted { store: *store, interface: true, address: GlobalParameter::SerialAddress };
        let restored = params::restore(&mut self.module, settings, wanted, &self.stop, progress)?;
        let told = to.iter().map(|to| {
            let refusal = restored.refusal(to.setting(), identity.product);
            let why = refusal.map(ToString::to_string).unwrap_or_default();
            ParameterTold { place: to.place, value: None, why }
        });
        Ok(ParametersTold { told: told.collect() })
    }
}

#[cfg(test)]
mod tests;
