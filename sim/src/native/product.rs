//! The products and firmwares that can be simulated.

use hal_sim::board::{self, BoardKind};
use tmcm::canopen::{Entry, Object};
use tmcm::module::{self, Spec};
use tmcm::param::{GlobalParameter, Row};
use tmcm::product;
use tmcm::store::{Memory, Need, Store};

use super::board::{Tmc429s, Tmc5160s};
use super::canopen::Canopen;
use super::running::{self, Running, Start};
use super::tmcl::Tmcl;

/// Makes the choice of products, and what is looked up by it.
macro_rules! choice {
    ($($product:ident $spec:ident $chips:ident;)*) => {
        /// A product that can be simulated, with its kind of board.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Product {
            $(#[doc = concat!("See [`", stringify!($spec), "`](product::", stringify!($spec), ").")] $product,)*
        }

        impl Product {
            /// All products, in the order of their numbers.
            pub const ALL: [Product; [$(Product::$product),*].len()] = [$(Product::$product),*];

            /// The specification of the product for its TMCL firmware.
            pub fn spec(self) -> &'static Spec {
                match self {
                    $(Product::$product => &product::$spec,)*
                }
            }

            /// The kind of the product's board, which tells its parts.
            pub fn kind(self) -> &'static BoardKind {
                match self {
                    $(Product::$product => &board::$spec,)*
                }
            }

            /// Starts the product's TMCL firmware.
            fn start(self, start: Start<'_>) -> (Box<dyn Running>, Vec<String>) {
                match self {
                    $(Product::$product => {
                        const AXES: usize = product::$spec.axes as usize;
                        const CONTROLLERS: usize = $chips::controllers(product::$spec.axes);
                        running::start::<Tmcl<product::$product, AXES, CONTROLLERS>, _, _, _, _>(start)
                    })*
                }
            }

            /// The contents of an EEPROM of the TMCL firmware with `number` as address on the buses.
            fn numbered_eeprom(self, number: u8) -> Option<Vec<u8>> {
                match self {
                    $(Product::$product => numbered::<product::$product>(number, tmcl_slots::<product::$product>()),)*
                }
            }
        }
    };
}
tmcm::products!(choice);

impl Default for Product {
    fn default() -> Self {
        let [usual, ..] = Self::ALL;
        usual
    }
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

/// The model of a module: a product, with one of its firmwares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Any product, with its TMCL firmware.
    Tmcl(Product),
    /// The TMCM-1140 with its CANopen firmware, which no other product has.
    Canopen,
}

impl Default for Model {
    fn default() -> Self {
        Model::Tmcl(Product::default())
    }
}

impl From<Product> for Model {
    fn from(product: Product) -> Self {
        Model::Tmcl(product)
    }
}

/// The TMCM-1140 with a firmware.
impl From<FirmwareKind> for Model {
    fn from(firmware: FirmwareKind) -> Self {
        match firmware {
            FirmwareKind::Tmcl => Model::default(),
            FirmwareKind::Canopen => Model::Canopen,
        }
    }
}

impl Product {
    /// The product's name, such as `TMCM-1140`.
    pub fn name(self) -> &'static str {
        self.kind().name
    }

    /// The product of a name, such as `TMCM-1140` or, for short, `1140`, in capitals or small letters.
    pub fn named(name: &str) -> Option<Product> {
        let product = |product: &Product| {
            let number = product.name().trim_start_matches("TMCM-");
            name == number || name.eq_ignore_ascii_case(product.name())
        };
        Self::ALL.into_iter().find(product)
    }

    /// The product of a number: the upper half of the reply to command 136, type 1.
    pub fn numbered(number: u16) -> Option<Product> {
        Self::ALL.into_iter().find(|product| product.spec().number == number)
    }
}

impl FirmwareKind {
    /// The firmware of a name: `tmcl` or `canopen`.
    pub fn named(name: &str) -> Option<FirmwareKind> {
        match name {
            "tmcl" => Some(FirmwareKind::Tmcl),
            "canopen" => Some(FirmwareKind::Canopen),
            _ => None,
        }
    }
}

impl Model {
    /// A product with a firmware.
    ///
    /// # Errors
    /// A message: the product has no such firmware.
    pub fn of(product: Product, firmware: FirmwareKind) -> Result<Model, String> {
        match (product, firmware) {
            (product, FirmwareKind::Tmcl) => Ok(Model::Tmcl(product)),
            (Product::Tmcm1140, FirmwareKind::Canopen) => Ok(Model::Canopen),
            (product, FirmwareKind::Canopen) => {
                let (name, only) = (product.name(), Product::Tmcm1140.name());
                Err(format!("the {name} has no CANopen firmware, only the {only} has"))
            }
        }
    }

    /// The product.
    pub fn product(self) -> Product {
        match self {
            Model::Tmcl(product) => product,
            Model::Canopen => Product::Tmcm1140,
        }
    }

    /// The firmware in it.
    pub fn firmware(self) -> FirmwareKind {
        match self {
            Model::Tmcl(_) => FirmwareKind::Tmcl,
            Model::Canopen => FirmwareKind::Canopen,
        }
    }

    /// Starts the firmware; the messages for a person are about the contents of the EEPROM.
    pub(super) fn start(self, start: Start<'_>) -> (Box<dyn Running>, Vec<String>) {
        match self {
            Model::Tmcl(product) => product.start(start),
            Model::Canopen => running::start::<Canopen, _, _, _, _>(start),
        }
    }

    /// The contents of an EEPROM with `number` as address on the buses: serial address and CAN identifier, or node ID.
    /// `None` if these are the factory defaults.
    pub fn numbered_eeprom(self, number: u8) -> Option<Vec<u8>> {
        match self {
            Model::Tmcl(product) => product.numbered_eeprom(number),
            Model::Canopen => numbered::<product::Tmcm1140Canopen>(number, Entry::of(Object::NodeId).row().slot(0)),
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
