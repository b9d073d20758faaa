//! Labels and constants.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use tmcm::tmcl::Instruction;

use super::include;
use super::message::Message;
use super::source::Source;
use crate::product::{self, Product};

/// The meaning of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Label(usize),
    /// A constant and its value; `None` until its line has been evaluated.
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
    product: Option<Product>,
    /// For each name in lower case its index in `list`.
    indices: HashMap<String, usize>,
}

impl Symbols {
    /// No names yet, in a program for this product.
    pub(super) fn new(product: Option<Product>) -> Self {
        Symbols { product, ..Symbols::default() }
    }

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

    /// All names, those of the built-in files as well, in the order of their definitions.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.list.iter().map(|symbol| symbol.name.as_str())
    }

    /// Joins these names and, behind them, those of others, for the product of the others. Of two that are the same
    /// these come first.
    pub(super) fn with(&self, others: &Symbols) -> Symbols {
        let mut both = Symbols { product: others.product, ..self.clone() };
        for symbol in &others.list {
            if let Entry::Vacant(entry) = both.indices.entry(symbol.name.to_lowercase()) {
                entry.insert(both.list.len());
                both.list.push(symbol.clone());
            }
        }
        both
    }

    /// The same names, of which messages do not say which product has them.
    pub(super) fn of_no_product(self) -> Symbols {
        Symbols { product: None, ..self }
    }

    fn get(&self, name: &str) -> Option<&Symbol> {
        self.list.get(*self.indices.get(&name.to_lowercase())?)
    }

    /// Defines a name. The error is a message about a name that is a mnemonic or defined already.
    pub(super) fn define(
        &mut self,
        name: &str,
        meaning: Meaning,
        source: &Arc<Source>,
        line: usize,
    ) -> Result<(), Message> {
        if Instruction::by_mnemonic(name).is_some() {
            return Err(Message::new(format!("'{name}' is a command")).advise("take another name"));
        }
        match self.indices.entry(name.to_lowercase()) {
            Entry::Occupied(entry) => {
                let first = self.list.get(*entry.get());
                let definition =
                    first.map_or_else(String::new, |first| format!("{}:{}", first.source.name, first.line));
                Err(Message::new(format!("'{name}' is defined twice")).advise(format!("it is also in {definition}")))
            }
            Entry::Vacant(entry) => {
                entry.insert(self.list.len());
                self.list.push(Symbol { name: name.into(), meaning, source: Arc::clone(source), line });
                Ok(())
            }
        }
    }

    /// Sets the value of a constant, if this line is the one that defines it.
    pub(super) fn set(&mut self, name: &str, value: i64, source: &Arc<Source>, line: usize) {
        let index = self.indices.get(&name.to_lowercase());
        if let Some(symbol) = index.and_then(|index| self.list.get_mut(*index))
            && matches!(symbol.meaning, Meaning::Constant(None))
            && symbol.line == line
            && Arc::ptr_eq(&symbol.source, source)
        {
            symbol.meaning = Meaning::Constant(Some(value));
        }
    }

    /// The value of a name in an expression. The error is a message about a name without a value.
    pub(super) fn resolve(&self, name: &str) -> Result<i64, Message> {
        if let Some(value) = self.value(name) {
            return Ok(value);
        }
        if let Some(Symbol { name, source, line, .. }) = self.get(name) {
            let advice = format!("its line ({}:{line}) has to be above this one", source.name);
            return Err(Message::new(format!("'{name}' has no value yet")).advise(advice));
        }
        if let Some(file) = self.product.and_then(|product| include::file_with(product.spec(), name)) {
            let advice = format!("it is in a built-in file: add the line #include {file}");
            return Err(Message::new(format!("unknown name '{name}'")).advise(advice));
        }
        let others = Product::ALL.into_iter().filter(|other| include::file_with(other.spec(), name).is_some());
        let others: Vec<&str> = others.map(product::short).collect();
        if let Some(product) = self.product
            && !others.is_empty()
        {
            let (this, others) = (product.name(), others.join(", "));
            return Err(Message::new(format!("unknown name '{name}': the {this} does not have it"))
                .advise(format!("--product says which module the program is for, and there it is with {others}")));
        }
        let names = self.list.iter().map(|symbol| symbol.name.as_str());
        Err(Message::new(format!("unknown name '{name}'")).suggest(name, names))
    }
}
