//! What an image says of itself: a symbol without memory, whose name has product and firmware.

use hal_sim::mcu::mark;

use crate::native::{Model, Product};

/// How the names of these symbols begin.
const MARK: &str = "_firmware_";
/// How they go on, and what that means.
const MODELS: [(&str, Model); 4] = [
    ("TMCM_1140_tmcl", Model::Tmcl(Product::Tmcm1140)),
    ("TMCM_1140_canopen", Model::Canopen),
    ("TMCM_6110_tmcl", Model::Tmcl(Product::Tmcm6110)),
    ("TMCM_3212_tmcl", Model::Tmcl(Product::Tmcm3212)),
];

/// Product and firmware of an image; `None` if it does not say, as other people's images do not.
///
/// # Errors
/// The file is no image, or says that it is something of which nothing is known here.
pub fn model(elf: &[u8]) -> Result<Option<Model>, String> {
    let Some(name) = mark(elf, MARK).map_err(|stop| stop.to_string())? else { return Ok(None) };
    let model = MODELS.iter().find(|(known, _)| *known == name).map(|(_, model)| *model);
    model.map(Some).ok_or_else(|| format!("it is an image of {name}, which cannot be simulated"))
}
