//! Cases on a flash image.

use tmcm_sim::ImageModule;
use tmcm_sim::scenario::suite::Start;
use tmcm_sim::scenario::{Case, Stand};

/// Begins a case on an image of the case's product and firmware; a case that says that it is not for the image is left
/// out.
pub fn on_image(elf: &[u8], case: &Case) -> Start<Stand<ImageModule>> {
    match &case.not_on_image {
        Some(reason) => Start::LeftOut(reason.clone()),
        None => Stand::image(elf, case).map_or_else(Start::Failed, Start::Ready),
    }
}
