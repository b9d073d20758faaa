//! A link to a virtual module inside this program, which exists as long as the link.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use hal_sim::clock::Nanos;
use hal_sim::world::config::WorldConfig;
use tmcl_link::Tap;
use tmcl_tools::product::Product;
use tmcl_tools::stop::Stop;
use tmcl_tools::wire::{LinkError, Wire};
use tmcm::module::Source;
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{self, Telegram};
use tmcm_sim::{NativeModule, VirtualModule};

use super::log::Log;
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
pub(crate) struct Simulated {
    module: NativeModule,
    timeout: Duration,
    pub(super) log: Log,
}

impl Simulated {
    pub(super) fn new(product: Product, surroundings: &Surroundings, timeout: Duration) -> Result<Self, Failure> {
        let world = surroundings.world.as_deref().map(|path| read_world(path, product)).transpose()?;
        let eeprom = surroundings.eeprom.as_deref().map(|path| EepromFile::open_one(path, product)).transpose()?;
        let contents = eeprom.as_ref().and_then(EepromFile::contents);
        let module = NativeModule::of(product, &world.unwrap_or_else(WorldConfig::default), contents, SEED);
        if let Some(file) = eeprom {
            module.board().borrow_mut().at25_mut().keep_in(Box::new(file));
        }
        Ok(Simulated { module, timeout, log: Log::default() })
    }
}

impl Wire for Simulated {
    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let request = binary::encode_command(u8::try_from(address).map_err(|_| LinkError::Address)?, command);
        let time = self.time();
        let Simulated { module, timeout, log } = self;
        // What has come before is no reply to this request.
        while let Some(sent) = module.sent() {
            log.back_at(Duration::from_nanos(sent.at), &sent.bytes);
        }
        log.out_at(time, &request);
        let sent = module.exchange(Source::Usb, request, timeout.as_nanos() as Nanos);
        match &sent {
            Some(sent) => log.back_at(Duration::from_nanos(sent.at), &sent.bytes),
            None => log.give_up_at(Duration::from_nanos(module.now())),
        }
        log.check().map_err(LinkError::Log)?;
        sent.and_then(|sent| sent.telegram()).ok_or(LinkError::NoReply { bytes: 0 })
    }

    fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    fn time(&self) -> Duration {
        Duration::from_nanos(self.module.now())
    }

    fn pause(&mut self, time: Duration, stop: &dyn Stop) -> bool {
        self.module.run(time.as_nanos() as Nanos);
        stop.happened()
    }

    fn simulated(&mut self) -> Option<&mut NativeModule> {
        Some(&mut self.module)
    }
}
