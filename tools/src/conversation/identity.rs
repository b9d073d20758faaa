//! The identity of a module: its product and the version of its firmware.

use std::fmt;

use crate::product::Product;

/// Facts that are known of a module, from the user or from its reply to command 136, type 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The number of the product, such as 1140.
    pub number: u16,
    /// Major and minor version of the firmware; `None` if the module was not asked, or does not tell it.
    pub version: Option<(u8, u8)>,
    /// The product; `None` for one that is not known here.
    pub product: Option<Product>,
}

impl From<Product> for Identity {
    fn from(product: Product) -> Self {
        Identity { number: product.spec().number, version: None, product: Some(product) }
    }
}

impl Identity {
    /// The identity that a module tells in the value of its reply.
    pub fn told(value: i32) -> Self {
        let [high, low, major, minor] = value.to_be_bytes();
        let number = u16::from_be_bytes([high, low]);
        Identity { number, version: Some((major, minor)), product: Product::numbered(number) }
    }
}

/// As the module itself writes it in its version string, such as `1140V142`; the number alone without a version.
impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.version {
            Some((major, minor)) => write!(f, "{}V{major}{minor:02}", self.number),
            None => write!(f, "{}", self.number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_alone_decides() {
        let told = Identity::told(0x17DE_012E);
        assert_eq!((told.product, told.to_string().as_str()), (Some(Product::Tmcm6110), "6110V146"));
        let told = Identity::told(0x270F_0203);
        assert_eq!((told.product, told.to_string().as_str()), (None, "9999V203"));
        assert_eq!(Identity::from(Product::Tmcm3110).to_string(), "3110");
    }
}
