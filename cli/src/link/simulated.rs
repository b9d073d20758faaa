//! A link to a virtual module inside this program, which exists as long as the link.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use hal_sim::world::config::WorldConfig;
use tmcl_server::eeprom::EepromFile;
use tmcl_server::worlds::read_world;
use tmcl_tools::product::Product;
use tmcl_tools::wire::{VirtualWire, Wire};
use tmcm_sim::NativeModule;

use crate::failure::Failure;
use crate::sim::say;

/// Seed of the module's random numbers.
const SEED: u32 = 1;

/// The surroundings of a virtual module inside this program; options of every command that can talk to one.
#[derive(Args, Clone, Debug, Default)]
pub struct Surroundings {
    /// For LINK sim: describes the motor, its stage, switches, encoder and supply, as for `tmcl sim`
    #[arg(long, value_name = "FILE.toml", global = true)]
    pub world: Option<PathBuf>,

    /// For LINK sim: keeps what the module stores in this file, which is made if there is none, as for `tmcl sim`
    #[arg(long, value_name = "FILE", global = true)]
    pub eeprom: Option<PathBuf>,
}

impl Surroundings {
    /// The first option that is given, for a message about a link that is real.
    pub(super) fn given(&self) -> Option<&'static str> {
        self.world.as_ref().map(|_| "--world").or(self.eeprom.as_ref().map(|_| "--eeprom"))
    }
}

/// A virtual module, of which virtual time passes only during an exchange, and when the host pauses.
pub(super) fn open(product: Product, surroundings: &Surroundings, timeout: Duration) -> Result<VirtualWire, Failure> {
    let world = surroundings.world.as_deref().map(|path| read_world(path, product)).transpose()?;
    let eeprom = surroundings.eeprom.as_deref().map(|path| EepromFile::open_one(path, product, say)).transpose()?;
    let contents = eeprom.as_ref().and_then(EepromFile::contents);
    let module = NativeModule::of(product, &world.unwrap_or_else(WorldConfig::default), contents, SEED);
    if let Some(file) = eeprom {
        module.board().borrow_mut().at25_mut().keep_in(Box::new(file));
    }
    let mut wire = VirtualWire::new(module);
    wire.set_timeout(timeout);
    Ok(wire)
}
