//! The flash image of option --image, and the modules that run it.

use std::fmt::Display;
use std::path::Path;

use tmcl_link::wording::words;
use tmcm_sim::Model;
use tmcm_sim::fleet::{Fleet, Member};
use tmcm_sim::image::{self, ImageModule, Setup};

use crate::SEED;
use crate::failure::Failure;
use crate::files::read_file;
use crate::options::{self, Options};

/// Largest size of an image file in bytes: far above that of any image with debug information.
const LARGEST_IMAGE: u64 = 1 << 28;

/// The image of option --image.
pub struct Image<'a> {
    pub(crate) path: &'a Path,
    /// The bytes of the image.
    pub elf: Vec<u8>,
    /// Product and firmware, if it tells.
    pub model: Option<Model>,
}

impl<'a> Image<'a> {
    /// Reads an image.
    ///
    /// # Errors
    /// The file cannot be read, or is no image.
    pub fn read(path: &'a Path) -> Result<Self, Failure> {
        let elf = read_file(path, LARGEST_IMAGE);
        let none = |error: &dyn Display| Self::failed(path, error, options::IMAGES);
        let elf = elf.map_err(|error| none(&format!("cannot be read: {}", words(error))))?;
        let model = image::model(&elf).map_err(|error| none(&error))?;
        Ok(Image { path, elf, model })
    }

    fn failed(path: &Path, error: &dyn Display, advice: &str) -> Failure {
        let shown = path.display();
        Failure::Failed(format!("--image: {shown}: {error}. {advice}"))
    }

    /// The modules that run it.
    pub(crate) fn start(&self, options: &Options, members: &[Member<'_>]) -> Result<Fleet<ImageModule>, Failure> {
        // Only module 1 has hosts at its USB connector.
        let mut usb = options.needs_usb();
        Fleet::start(members, SEED, |Member { model, world, eeprom }, seed| {
            let setup = Setup { usb: std::mem::take(&mut usb), log: options.log };
            let module = ImageModule::of(model.product(), &self.elf, world, eeprom, seed, setup);
            module.map_err(|stop| Self::failed(self.path, &stop, options::advice(&stop)))
        })
    }
}
