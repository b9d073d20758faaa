//! A flash image, and the module that runs it.

use std::rc::Rc;
use std::time::Duration;

use hal_sim::mcu::Stop;
use tmcl_studio::types::{self, Start};
use tmcl_studio::virtual_module::Virtual;
use tmcl_tools::product;
use tmcm_sim::fleet::Member;
use tmcm_sim::image::{self, ImageModule, Setup};
use tmcm_sim::{FirmwareKind, Product};

/// Advice for whoever has another file.
const IMAGES: &str = "A flash image is the file that `cargo fw` builds, target/thumbv7em-none-eabi/release/tmcm1140, or one \
                      of its like: docs/image.md";
/// The page is connected by USB, and has the whole log.
const SETUP: Setup = Setup { usb: true, log: true };

/// A flash image of the TMCL firmware.
#[derive(Clone, Debug)]
pub struct Image {
    elf: Rc<[u8]>,
    /// The product that the image is for; `None` if it does not tell.
    product: Option<Product>,
}

impl Image {
    /// The image in a file.
    ///
    /// # Errors
    /// The file is no image for the microcontroller, or one of which a page can make nothing.
    pub fn read(elf: Vec<u8>) -> Result<Self, String> {
        let model = image::model(&elf).map_err(|error| format!("{error}. {IMAGES}"))?;
        if let Some(model) = model.filter(|model| model.firmware() == FirmwareKind::Canopen) {
            return Err(format!(
                "this is the image of the CANopen firmware of the {}. It takes no TMCL commands, and the page has nothing \
                 else to say to a module; `tmcl sim --image` runs it with a CAN adapter",
                model.product().name()
            ));
        }
        Ok(Image { elf: elf.into(), product: model.map(|model| model.product()) })
    }

    /// The facts that the page is told of the image.
    pub fn told(&self) -> types::Image {
        types::Image { product: self.product.map(|product| product::short(product).into()) }
    }

    /// A fresh module that runs it, at the moment `at`.
    ///
    /// # Errors
    /// The image is for another product, the module cannot be as is wanted, or the firmware does not start.
    pub fn start(&self, start: &Start, at: Duration) -> Result<Virtual<ImageModule>, String> {
        let wanted = product::named(&start.product)?;
        if let Some(product) = self.product.filter(|product| *product != wanted) {
            return Err(format!("the image is one for the {}, and not for the {}", product.name(), wanted.name()));
        }
        let elf = Rc::clone(&self.elf);
        let make = move |Member { model, world, eeprom }: Member<'_>, seed| {
            let product = model.product();
            ImageModule::of(product, &elf, world, eeprom, seed, SETUP).map_err(|stop| advised(&stop, product))
        };
        Virtual::of(start, at, Box::new(make))
    }
}

/// Why a module does not start that was to be this product, and what helps.
fn advised(stop: &Stop, product: Product) -> String {
    match stop {
        Stop::Pin(_) => format!(
            "{stop}. The image is for another product than the {}, or for a board of your own, whose pins the emulator has to \
             know as well: docs/porting.md",
            product.name()
        ),
        Stop::Image(_) => format!("{stop}. {IMAGES}"),
        _ => format!("the firmware does not start: {stop}"),
    }
}
