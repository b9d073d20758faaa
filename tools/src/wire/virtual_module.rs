//! A virtual module at the other end of the wire, in virtual time.

use std::time::Duration;

use tmcm::module::Source;
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;
use tmcm_sim::{NativeModule, VirtualModule};

use super::framing::{Framing, Serial};
use super::{LinkError, Nobody, Tap, Wire};
use crate::stop::Stop;

/// Longest wait for a reply, unless another one is set.
const TIMEOUT: Duration = Duration::from_secs(1);

/// A virtual module as the only one at a USB cable. Its time passes during exchanges and pauses, as fast as the
/// computer can.
pub struct VirtualWire {
    module: NativeModule,
    framing: Serial,
    timeout: Duration,
    tap: Box<dyn Tap>,
}

impl VirtualWire {
    /// A wire to this module.
    pub fn new(module: NativeModule) -> Self {
        let mut framing = Serial::default();
        framing.take_any();
        VirtualWire { module, framing, timeout: TIMEOUT, tap: Box::new(Nobody) }
    }

    /// Has `tap` hear all that goes over the wire from now on.
    pub fn listen(&mut self, tap: Box<dyn Tap>) {
        self.tap = tap;
    }
}

impl Wire for VirtualWire {
    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let time = self.time();
        let VirtualWire { module, framing, timeout, tap } = self;
        let request = framing.telegram(address, command)?;
        // What has come before is no reply to this request.
        while let Some(sent) = module.sent() {
            tap.at(Duration::from_nanos(sent.at));
            framing.late(&sent.bytes, tap.as_mut());
        }
        tap.at(time);
        tap.out(&request);
        let sent = module.exchange(Source::Usb, request, timeout.as_nanos() as u64);
        tap.at(Duration::from_nanos(sent.as_ref().map_or(module.now(), |sent| sent.at)));
        let reply = sent.and_then(|sent| framing.take(&sent.bytes, tap.as_mut()));
        if reply.is_none() {
            tap.give_up();
        }
        tap.check().map_err(LinkError::Log)?;
        reply.unwrap_or_else(|| Err(framing.give_up()))
    }

    fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    fn time(&self) -> Duration {
        Duration::from_nanos(self.module.now())
    }

    fn pause(&mut self, time: Duration, stop: &dyn Stop) -> bool {
        self.module.run(time.as_nanos() as u64);
        stop.happened()
    }

    fn simulated(&mut self) -> Option<&mut NativeModule> {
        Some(&mut self.module)
    }
}
