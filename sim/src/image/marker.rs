//! The mark by which an image tells what it is: a symbol without memory, whose name has product and firmware.

use hal_sim::mcu::mark;

use crate::native::{FirmwareKind, Model, Product};

/// How the names of these symbols begin.
const MARK: &str = "_firmware_";

/// Product and firmware of an image; `None` if it does not say, as other people's images do not.
///
/// # Errors
/// The file is no image, or says that it is something of which nothing is known here.
pub fn model(elf: &[u8]) -> Result<Option<Model>, String> {
    let Some(name) = mark(elf, MARK).map_err(|stop| stop.to_string())? else { return Ok(None) };
    known(&name).map(Some).ok_or_else(|| format!("it is an image of {name}, which cannot be simulated"))
}

/// The meaning of the rest of the name: that of a product, with `_` for `-`, and then that of a firmware.
fn known(name: &str) -> Option<Model> {
    let (product, firmware) = name.rsplit_once('_')?;
    let product = Product::ALL.into_iter().find(|known| known.name().replace('-', "_") == product)?;
    Model::of(product, FirmwareKind::named(firmware)?).ok()
}
