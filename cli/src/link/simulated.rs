//! A link to a virtual module inside this program, which exists as long as the link.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use hal_sim::clock::Nanos;
use hal_sim::world::config::WorldConfig;
use tmcl_tools::product::Product;
use tmcm::module::Source;
use tmcm::tmcl::binary::Telegram;
use tmcm_sim::{NativeModule, VirtualModule};

use super::{LinkError, Log};
use crate::failure::Failure;
use crate::sim::eeprom::EepromFile;
use crate::sim::read_world;

/// Seed of the module's random numbers.
const SEED: u32 = 1;

/// What surrounds a virtual module inside this program; options of every command that can talk to one.
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

/// A virtual module. Virtual time passes only during an exchange, and when the host pauses.
pub(super) struct Simulated(pub(super) NativeModule);

impl fmt::Debug for Simulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Simulated").field("now", &self.0.now()).finish()
    }
}

impl Simulated {
    pub(super) fn new(product: Product, surroundings: &Surroundings) -> Result<Self, Failure> {
        let world = surroundings.world.as_deref().map(|path| read_world(path, product)).transpose()?;
        let eeprom = surroundings.eeprom.as_deref().map(|path| EepromFile::open_one(path, product)).transpose()?;
        let contents = eeprom.as_ref().and_then(EepromFile::contents);
        let module = NativeModule::of(product, &world.unwrap_or_else(WorldConfig::default), contents, SEED);
        if let Some(file) = eeprom {
            module.board().borrow_mut().at25_mut().keep_in(Box::new(file));
        }
        Ok(Simulated(module))
    }

    pub(super) fn exchange(
        &mut self,
        request: &Telegram,
        timeout: Duration,
        log: &mut Log,
    ) -> Result<Telegram, LinkError> {
        // What has come before is no reply to this request.
        while let Some(sent) = self.0.sent() {
            log.back(Duration::from_nanos(sent.at), &sent.bytes);
        }
        log.out(self.time(), request);
        let sent = self.0.exchange(Source::Usb, *request, timeout.as_nanos() as Nanos);
        if let Some(sent) = &sent {
            log.back(Duration::from_nanos(sent.at), &sent.bytes);
        }
        sent.and_then(|sent| sent.telegram()).ok_or(LinkError::NoReply { bytes: 0 })
    }

    /// Virtual time since the link was opened.
    pub(super) fn time(&self) -> Duration {
        Duration::from_nanos(self.0.now())
    }

    /// Lets virtual time pass.
    pub(super) fn pass(&mut self, time: Duration) {
        self.0.run(time.as_nanos() as Nanos);
    }
}
