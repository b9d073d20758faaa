//! A virtual module at the other end of the wire, in virtual time.

use std::time::Duration;

use tmcm::module::Source;
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{self, Telegram};
use tmcm_sim::{NativeModule, VirtualModule};

use super::{LinkError, Nobody, Tap, Wire};
use crate::stop::Stop;

/// Longest wait for a reply, unless another one is set.
const TIMEOUT: Duration = Duration::from_secs(1);

/// A virtual module as the only one at a USB cable. Its time passes during exchanges and pauses, as fast as the computer can.
pub struct VirtualWire {
    module: NativeModule,
    timeout: Duration,
    tap: Box<dyn Tap>,
}

impl VirtualWire {
    /// A wire to this module.
    pub fn new(module: NativeModule) -> Self {
        VirtualWire { module, timeout: TIMEOUT, tap: Box::new(Nobody) }
    }

    /// Has `tap` hear all that goes over the wire from now on.
    pub fn listen(&mut self, tap: Box<dyn Tap>) {
        self.tap = tap;
    }
}

impl Wire for VirtualWire {
    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let address = u8::try_from(address).map_err(|_| LinkError::Address)?;
        let (request, time) = (binary::encode_command(address, command), self.time());
        let VirtualWire { module, timeout, tap } = self;
        // What has come before is no reply to this request.
        while let Some(sent) = module.sent() {
            tap.at(Duration::from_nanos(sent.at));
            tap.back(&sent.bytes);
        }
        tap.at(time);
        tap.out(&request);
        let sent = module.exchange(Source::Usb, request, timeout.as_nanos() as u64);
        tap.at(Duration::from_nanos(sent.as_ref().map_or(module.now(), |sent| sent.at)));
        match &sent {
            Some(sent) => tap.back(&sent.bytes),
            None => tap.give_up(),
        }
        tap.check().map_err(LinkError::Log)?;
        sent.and_then(|sent| sent.telegram()).ok_or(LinkError::NoReply { bytes: 0 })
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
