//! The log: a line for each telegram and frame, in their order.

use hal_sim::clock::Nanos;
use tmcm::can::Frame;

use super::line::{self, Direction, Place, line};
use super::talk::{Said, Talk};
use crate::native::{FirmwareKind, Model, Product};

/// The name of the CAN bus.
pub const CAN: &str = "can";

/// The traffic on the links of modules, as text. A line has the time in seconds, the link with its host, the direction
/// (`>` goes to the modules, `<` comes from them), the bytes and what they say:
///
/// ```text
///     0.012000  usb 3    >  01 06 01 00 00 00 00 00 08  to 1: GAP 1, 0
///     0.013000  usb 3    <  02 01 64 06 00 00 00 00 6D  from 1: 0 microsteps (actual position), status 100 ok
/// ```
#[derive(Debug)]
pub struct Transcript {
    text: String,
    talks: Vec<(Place, Talk)>,
    /// The products of the modules; `None` for one of which that is not known.
    products: Vec<Option<Product>>,
    /// The firmware whose language is spoken on the CAN bus.
    firmware: FirmwareKind,
}

impl Transcript {
    /// The log of modules of which it is known what they are.
    pub fn of(models: impl IntoIterator<Item = Model>) -> Self {
        let models: Vec<Model> = models.into_iter().collect();
        let firmware = models.first().copied().unwrap_or_default().firmware();
        let products = models.into_iter().map(|model| Some(model.product())).collect();
        Transcript { text: String::new(), talks: Vec::new(), products, firmware }
    }

    /// The log of a module that speaks TMCL, and of which it may be known what it is. If it is not known, values have
    /// names and units only from then on that the module has told what it is.
    pub fn of_module(product: Option<Product>) -> Self {
        Transcript { text: String::new(), talks: Vec::new(), products: vec![product], firmware: FirmwareKind::Tmcl }
    }

    /// Bytes of a host arrive at the modules. `at` is the time in nanoseconds.
    pub fn hear(&mut self, at: Nanos, place: Place, bytes: &[u8]) {
        let said = self.talk(place).host(bytes);
        said.iter().for_each(|said| self.say(at, place, Direction::Out, said));
    }

    /// A host has been silent for so long that an unfinished telegram is given up.
    pub fn silence(&mut self, at: Nanos, place: Place) {
        let torn = self.talk(place).silence();
        torn.iter().for_each(|said| self.say(at, place, Direction::Out, said));
    }

    /// A host has gone; what it has sent in part is told.
    pub fn forget(&mut self, at: Nanos, place: Place) {
        self.silence(at, place);
        self.talks.retain(|(known, _)| *known != place);
    }

    /// Bytes of a module, which has this index, arrive at a host.
    pub fn answer(&mut self, at: Nanos, place: Place, module: usize, bytes: &[u8]) {
        let product = self.product(module);
        let said = self.talk(place).module(module, product, bytes);
        for said in said {
            self.say(at, place, Direction::Back, &said);
            if let Some(told) = said.product
                && let Some(product) = self.products.get_mut(module)
            {
                *product = Some(told);
            }
        }
    }

    /// A reply of a module is lost on its way to a host.
    pub fn lose(&mut self, at: Nanos, place: Place, module: usize, bytes: &[u8]) {
        let product = self.product(module);
        for said in self.talk(place).module(module, product, bytes) {
            self.say(at, place, Direction::Back, &Said { meaning: format!("lost: {}", said.meaning), ..said });
        }
    }

    /// A host waits no longer for a reply of the module with this index, of which nothing has come, or the beginning.
    pub fn give_up(&mut self, at: Nanos, place: Place, module: usize) {
        let torn = self.talk(place).give_up(module);
        self.say(at, place, Direction::Back, &torn);
    }

    /// A frame is complete on the CAN bus: one of a host, or of the module with this index.
    pub fn frame(&mut self, at: Nanos, place: Place, module: Option<usize>, frame: &Frame) {
        let (said, way) = self.frame_said(module, frame);
        self.say(at, place, way, &said);
    }

    /// A frame of a module is lost on its way to the bus.
    pub fn lose_frame(&mut self, at: Nanos, place: Place, module: usize, frame: &Frame) {
        let (said, way) = self.frame_said(Some(module), frame);
        self.say(at, place, way, &Said { meaning: format!("lost: {}", said.meaning), ..said });
    }

    /// The lines since the last call, each with its end.
    pub fn take(&mut self) -> String {
        std::mem::take(&mut self.text)
    }

    fn frame_said(&mut self, module: Option<usize>, frame: &Frame) -> (Said, Direction) {
        let (from, firmware) = (module.map(|module| self.product(module)), self.firmware);
        // All adapters are on one bus.
        let meaning = self.talk(Place::alone(CAN)).frame(from, firmware, frame);
        let way = if module.is_some() { Direction::Back } else { Direction::Out };
        (Said { bytes: line::frame(frame), meaning, product: None }, way)
    }

    fn product(&self, module: usize) -> Option<Product> {
        self.products.get(module).copied().flatten()
    }

    fn say(&mut self, at: Nanos, place: Place, way: Direction, said: &Said) {
        self.text.push_str(&line(at, place, way, &said.bytes, &said.meaning));
        self.text.push('\n');
    }

    fn talk(&mut self, place: Place) -> &mut Talk {
        let index = self.talks.iter().position(|(known, _)| *known == place).unwrap_or_else(|| {
            self.talks.push((place, Talk::default()));
            self.talks.len() - 1
        });
        &mut self.talks[index].1
    }
}
