//! A link to a virtual module inside this program, which exists as long as the link.

use std::fmt;
use std::time::Duration;

use hal_sim::clock::Nanos;
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::binary::Telegram;

use super::LinkError;
use crate::product::Product;
use tmcm_sim::{NativeModule, VirtualModule};

/// Seed of the module's random numbers.
const SEED: u32 = 1;

/// A virtual module in the default world, with a fresh EEPROM. Virtual time passes only during an exchange.
pub(super) struct Simulated(NativeModule);

impl fmt::Debug for Simulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Simulated").field("now", &self.0.now()).finish()
    }
}

impl Simulated {
    pub(super) fn new(product: Product) -> Self {
        Simulated(NativeModule::of(product, &WorldConfig::default(), None, SEED))
    }

    pub(super) fn exchange(&mut self, request: &Telegram, timeout: Duration) -> Result<Telegram, LinkError> {
        let sent = self.0.exchange(Source::Usb, *request, timeout.as_nanos() as Nanos);
        sent.and_then(|sent| sent.telegram()).ok_or(LinkError::NoReply { bytes: 0 })
    }
}
