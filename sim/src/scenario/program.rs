//! TMCL programs that scenarios load. Who runs the scenarios brings the assembler.

use std::path::Path;

use crate::native::Product;

/// An assembled program, whose first command has address 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Program {
    /// The commands in the order of their addresses.
    pub commands: Vec<tmcm::tmcl::Command>,
    /// Labels with their addresses, and constants with their values. Upper and lower case are the same.
    pub names: Vec<(String, i64)>,
    /// The names that are labels.
    pub labels: Vec<String>,
}

/// Assembles the program in a file for a product. The error says what is wrong with it.
pub type Assemble<'a> = dyn Fn(&Path, Product) -> Result<Program, String> + 'a;

impl Program {
    /// The address of a label or the value of a constant.
    pub fn value(&self, name: &str) -> Option<i64> {
        self.names.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, value)| *value)
    }

    /// The address of a label.
    pub fn address(&self, label: &str) -> Option<u16> {
        let known = self.labels.iter().any(|known| known.eq_ignore_ascii_case(label));
        self.value(label).filter(|_| known).and_then(|address| u16::try_from(address).ok())
    }
}
