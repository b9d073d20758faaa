//! The products and firmwares that can be simulated.

use hal_sim::board::{self, BoardKind};
use tmcm::canopen::{self, Entry, Object};
use tmcm::module::{self, Spec, TMCM_1140_AXES, Tmcm1140};
use tmcm::param::{GlobalParameter, Row};
use tmcm::store::{Memory, Need, Store};

use super::firmware::{Firmware, Start};
use super::{canopen as node, tmcl};

/// A product that can be simulated, with its kind of board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Product {
    /// The TMCM-1140.
    #[default]
    Tmcm1140,
}

/// A firmware that can be simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FirmwareKind {
    /// The firmware that speaks TMCL, and executes programs in it.
    #[default]
    Tmcl,
    /// The firmware that is a node of CANopen.
    Canopen,
}

/// What a module is: a product, with one of its firmwares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Model {
    /// The product.
    pub product: Product,
    /// The firmware in it.
    pub firmware: FirmwareKind,
}

impl From<Product> for Model {
    fn from(product: Product) -> Self {
        Model { product, ..Model::default() }
    }
}

impl From<FirmwareKind> for Model {
    fn from(firmware: FirmwareKind) -> Self {
        Model { firmware, ..Model::default() }
    }
}

impl Product {
    /// What the product is for its TMCL firmware.
    pub fn spec(self) -> &'static Spec {
        match self {
            Product::Tmcm1140 => &module::TMCM_1140,
        }
    }

    /// What the product's board consists of.
    pub fn kind(self) -> &'static BoardKind {
        match self {
            Product::Tmcm1140 => &board::TMCM_1140,
        }
    }
}

impl Model {
    /// Starts the firmware; the messages for a person are about the contents of the EEPROM.
    pub(super) fn start(self, start: Start<'_>) -> (Box<dyn Firmware>, Vec<String>) {
        match (self.product, self.firmware) {
            (Product::Tmcm1140, FirmwareKind::Tmcl) => tmcl::start::<Tmcm1140, TMCM_1140_AXES, 1>(start),
            (Product::Tmcm1140, FirmwareKind::Canopen) => node::start(start),
        }
    }

    /// The contents of an EEPROM with `number` as address on the buses: serial address and CAN identifier, or node ID.
    /// `None` if these are the factory defaults.
    pub fn numbered_eeprom(self, number: u8) -> Option<Vec<u8>> {
        match (self.product, self.firmware) {
            (Product::Tmcm1140, FirmwareKind::Tmcl) => numbered::<Tmcm1140>(number, tmcl_slots::<Tmcm1140>()),
            (Product::Tmcm1140, FirmwareKind::Canopen) => {
                numbered::<canopen::Tmcm1140>(number, Entry::of(Object::NodeId).row().slot(0))
            }
        }
    }
}

/// The slots of the addresses of a module with the TMCL firmware.
fn tmcl_slots<P: module::Product>() -> impl Iterator<Item = usize> {
    let rows = [GlobalParameter::SerialAddress, GlobalParameter::CanId].map(|parameter| P::SPEC.global.row(parameter));
    rows.into_iter().flatten().filter_map(Row::slot).map(usize::from)
}

fn numbered<P: Memory>(number: u8, slots: impl IntoIterator<Item = usize>) -> Option<Vec<u8>> {
    let mut store = Store::<P>::new();
    store.forget();
    for slot in slots {
        store.set(slot, number.into()).then_some(())?;
    }
    let mut contents = vec![0xFF; P::SIZE];
    let mut written = false;
    while !store.settled(Need::Settings) {
        let job = store.next_job()?;
        let address = usize::from(job.address);
        contents.get_mut(address..)?.get_mut(..job.page.len())?.copy_from_slice(&job.page);
        store.finish(true);
        written = true;
    }
    written.then_some(contents)
}
