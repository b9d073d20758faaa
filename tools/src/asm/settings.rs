//! Settings of the assembler: what a source is assembled for.

use crate::product::Product;

/// Settings of the assembler: what a source is assembled for, and how its warnings are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// The product; for one that is not known, `None`, there are no built-in files, and no warnings that need the
    /// tables of a product.
    pub product: Option<Product>,
    /// Address of the first command in program memory, from which labels count.
    pub origin: u16,
    /// True if warnings are errors.
    pub strict: bool,
}

impl From<Option<Product>> for Settings {
    fn from(product: Option<Product>) -> Self {
        Settings { product, ..Settings::default() }
    }
}
