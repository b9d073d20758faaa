//! The wire and the stop that the page gives to the tools.

use std::time::Duration;

use tmcl_tools::stop::Stop;
use tmcl_tools::wire::{LinkError, Wire};
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;

use crate::types::{Exchange, Outcome, Request};

/// Longest wait for a reply, unless another one is set.
const TIMEOUT: Duration = Duration::from_secs(1);

/// The functions of the page that are called.
#[derive(Clone, Copy, Debug)]
pub struct Calls {
    /// Sends a request, an [`Exchange`] as JSON, and gives its [`Outcome`] as JSON.
    pub exchange: fn(&[u8]) -> Vec<u8>,
    /// Lets time pass. True if it has been asked to end.
    pub pause: fn(Duration) -> bool,
    /// The clock: the time since some beginning.
    pub time: fn() -> Duration,
    /// Waits for so long, or until it has been asked to end; then true.
    pub within: fn(Duration) -> bool,
    /// Forgets what has been asked so far: it does not count any more.
    pub forget: fn(),
}

/// A link in another worker.
#[derive(Clone, Copy, Debug)]
pub struct PageWire {
    calls: Calls,
    timeout: Duration,
}

impl PageWire {
    /// A wire to the link that the page has opened.
    pub fn new(calls: Calls) -> Self {
        PageWire { calls, timeout: TIMEOUT }
    }
}

impl Wire for PageWire {
    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let timeout = u32::try_from(self.timeout.as_millis()).unwrap_or(u32::MAX);
        let asked = Exchange { request: Request::new(address, command), timeout };
        let told = serde_json::to_vec(&asked).map(|asked| (self.calls.exchange)(&asked));
        let told = told.and_then(|told| serde_json::from_slice::<Outcome>(&told));
        told.map_err(|error| LinkError::Lost(error.to_string()))?.into()
    }

    fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    fn time(&self) -> Duration {
        (self.calls.time)()
    }

    fn pause(&mut self, time: Duration, _: &dyn Stop) -> bool {
        (self.calls.pause)(time)
    }
}

/// Whether the user has pressed End.
#[derive(Clone, Copy, Debug)]
pub struct PageStop(pub Calls);

impl Stop for PageStop {
    fn within(&self, time: Duration) -> bool {
        (self.0.within)(time)
    }

    fn signal(&self) -> u8 {
        0
    }

    fn forget(&self) {
        (self.0.forget)();
    }
}
