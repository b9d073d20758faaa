//! The products that can be simulated.

use hal_sim::board::{self, BoardKind};
use tmcm::module::{self, Spec, TMCM_1140_AXES, Tmcm1140};
use tmcm::param::{GlobalParameter, Row};
use tmcm::store::{Need, Store};

use super::firmware::{self, Firmware, Start};

/// A product that can be simulated: its firmware on its kind of board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Product {
    /// The TMCM-1140 with its TMCL firmware.
    #[default]
    Tmcm1140,
}

impl Product {
    /// What the product is for its firmware.
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

    /// Starts the firmware of the product; the messages for a person are about the contents of the EEPROM.
    pub(super) fn start(self, start: Start<'_>) -> (Box<dyn Firmware>, Vec<String>) {
        match self {
            Product::Tmcm1140 => firmware::start::<Tmcm1140, TMCM_1140_AXES, 1>(start),
        }
    }

    /// The contents of an EEPROM with `number` as serial address and CAN identifier; `None` if these are the factory
    /// defaults.
    pub fn numbered_eeprom(self, number: i32) -> Option<Vec<u8>> {
        match self {
            Product::Tmcm1140 => numbered::<Tmcm1140>(number),
        }
    }
}

fn numbered<P: module::Product>(number: i32) -> Option<Vec<u8>> {
    let parameters = [GlobalParameter::SerialAddress, GlobalParameter::CanId];
    let rows = parameters.map(|parameter| P::SPEC.global.row(parameter));
    let rows = rows.into_iter().flatten().filter(|row| row.default != number);
    let slots: Vec<u8> = rows.filter_map(Row::slot).collect();
    let mut store = Store::<P>::new();
    store.forget();
    for slot in &slots {
        store.set((*slot).into(), number).then_some(())?;
    }
    let mut contents = vec![0xFF; P::SIZE];
    while !store.settled(Need::Settings) {
        let job = store.next_job()?;
        let address = usize::from(job.address);
        contents.get_mut(address..)?.get_mut(..job.page.len())?.copy_from_slice(&job.page);
        store.finish(true);
    }
    (!slots.is_empty()).then_some(contents)
}
