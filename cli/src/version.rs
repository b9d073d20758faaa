//! `tmcl --version`: the program's version and commit, and the products and firmwares that it knows.

use std::fmt::Write;
use std::sync::LazyLock;

use tmcm::canopen;
use tmcm_sim::{Model, Product};

/// Version and commit in a line, for `tmcl -V`.
pub const SHORT: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("TMCL_COMMIT"), ")");

/// The same with a line for each product: the versions of the firmwares that virtual modules run.
pub static LONG: LazyLock<String> = LazyLock::new(|| {
    let mut text = format!("{SHORT}\n\nVirtual modules and the firmwares they run:\n");
    for product in Product::ALL {
        let spec = product.spec();
        let has_canopen = Model::Canopen.product() == product;
        let canopen = if has_canopen { format!(", CANopen {}", canopen::VERSION) } else { String::new() };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {:<10} TMCL {}.{:02}{canopen}", product.name(), spec.major, spec.minor);
    }
    text.trim_end().into()
});
