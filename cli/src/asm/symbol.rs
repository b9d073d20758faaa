//! Labels and constants.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use tmcm::tmcl::Instruction;

use super::include;
use super::source::Source;
use super::suggest::suggestion;

use crate::product::PRODUCT;

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Label(usize),
    /// The value is there when its line has been worked out.
    Constant(Option<i64>),
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Symbol {
    name: String,
    meaning: Meaning,
    source: Arc<Source>,
    line: usize,
}

/// The names of a program. Upper and lower case are the same.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Symbols {
    list: Vec<Symbol>,
    places: HashMap<String, usize>,
}

impl Symbols {
    /// The labels with their addresses, in the order of the program.
    pub fn labels(&self) -> impl Iterator<Item = (&str, usize)> {
        self.list.iter().filter_map(|symbol| match symbol.meaning {
            Meaning::Label(address) => Some((symbol.name.as_str(), address)),
            Meaning::Constant(_) => None,
        })
    }

    /// The constants with their values, in the order of the program; those of the built-in files are left out.
    pub fn constants(&self) -> impl Iterator<Item = (&str, i64)> {
        self.list.iter().filter(|symbol| !symbol.source.built_in).filter_map(|symbol| match symbol.meaning {
            Meaning::Constant(Some(value)) => Some((symbol.name.as_str(), value)),
            Meaning::Constant(None) | Meaning::Label(_) => None,
        })
    }

    /// The address of a label or the value of a constant.
    pub fn value(&self, name: &str) -> Option<i64> {
        match self.get(name)?.meaning {
            Meaning::Label(address) => i64::try_from(address).ok(),
            Meaning::Constant(value) => value,
        }
    }

    fn get(&self, name: &str) -> Option<&Symbol> {
        self.list.get(*self.places.get(&name.to_lowercase())?)
    }

    /// Enters a name, or says why it cannot be had.
    pub(super) fn define(
        &mut self,
        name: &str,
        meaning: Meaning,
        source: &Arc<Source>,
        line: usize,
    ) -> Result<(), String> {
        if Instruction::by_mnemonic(name).is_some() {
            return Err(format!("'{name}' is a command; take another name"));
        }
        match self.places.entry(name.to_lowercase()) {
            Entry::Occupied(place) => {
                let first = self.list.get(*place.get());
                let place = first.map_or_else(String::new, |first| format!("{}:{}", first.source.name, first.line));
                Err(format!("'{name}' is defined twice; it is also in {place}"))
            }
            Entry::Vacant(place) => {
                place.insert(self.list.len());
                self.list.push(Symbol { name: name.into(), meaning, source: Arc::clone(source), line });
                Ok(())
            }
        }
    }

    /// Gives a constant its value, if it is the one that is defined in this line.
    pub(super) fn set(&mut self, name: &str, value: i64, source: &Arc<Source>, line: usize) {
        let place = self.places.get(&name.to_lowercase());
        if let Some(symbol) = place.and_then(|place| self.list.get_mut(*place))
            && matches!(symbol.meaning, Meaning::Constant(None))
            && symbol.line == line
            && Arc::ptr_eq(&symbol.source, source)
        {
            symbol.meaning = Meaning::Constant(Some(value));
        }
    }

    /// The value of a name in an expression, or what to say when there is none.
    pub(super) fn resolve(&self, name: &str) -> Result<i64, String> {
        if let Some(value) = self.value(name) {
            return Ok(value);
        }
        if let Some(Symbol { name, source, line, .. }) = self.get(name) {
            return Err(format!(
                "'{name}' has no value yet; its line ({}:{line}) has to be above this one",
                source.name
            ));
        }
        if let Some(file) = include::file_with(PRODUCT, name) {
            return Err(format!("unknown name '{name}'; it is in a built-in file: add the line #include {file}"));
        }
        let names = self.list.iter().map(|symbol| symbol.name.as_str());
        Err(format!("unknown name '{name}'{}", suggestion(name, names)))
    }
}
