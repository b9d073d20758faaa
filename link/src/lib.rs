//! The wires of an operating system to modules, for the tools: serial devices, TCP, and serial CAN adapters (SLCAN)
//! over either; and signals that ask to end.

mod device;
mod exchange;
pub mod number;
pub mod poll;
mod serial;
pub mod signal;
pub mod system;
mod tcp;
pub mod wording;

use std::fmt;
use std::time::{Duration, Instant};

use tmcl_tools::stop::Stop;
use tmcl_tools::wire::framing::{Framing, Serial, Slcan};
use tmcl_tools::wire::{LinkError, Nobody, Tap, Wire};
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;
use tmcm_sim::wire::CAN;

use device::Device;
use exchange::{converse, drop_stale, open_channel};
pub use signal::EndSignal;
pub use tcp::connect;

/// Why a link cannot be opened, or signals not be watched for: the message for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error(pub String);

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

/// The error of a device or a connection, in words.
fn lost(error: impl Into<std::io::Error>) -> LinkError {
    LinkError::Lost(wording::words(error))
}

/// An open link.
pub struct Link {
    device: Device,
    framing: Box<dyn Framing>,
    /// The kind of the link, as logs name it.
    name: &'static str,
    timeout: Duration,
    tap: Box<dyn Tap>,
    /// When the link was opened.
    opened: Instant,
}

impl Link {
    fn new(device: Device, name: &'static str, timeout: Duration) -> Self {
        let (framing, tap) = (Box::new(Serial::default()), Box::new(Nobody));
        Link { device, framing, name, timeout, tap, opened: Instant::now() }
    }

    /// Opens a serial device at `baud` bit/s. `timeout` is the longest wait for a reply.
    ///
    /// # Errors
    /// The device cannot be opened, or another program has it.
    pub fn serial(path: &str, baud: u32, timeout: Duration) -> Result<Self, Error> {
        let mut link = Self::new(Device::Serial(serial::open(path, baud)?), "serial", timeout);
        if system::leads_to_one(path) {
            link.take_any();
        }
        Ok(link)
    }

    /// Connects to a TCP port that carries the bytes of a serial link. `timeout` is the longest wait for the
    /// connection, and for a reply.
    ///
    /// # Errors
    /// Nobody takes the connection.
    pub fn tcp(address: &str, timeout: Duration) -> Result<Self, Error> {
        let stream = connect(address, timeout, "--tcp")?;
        // Somebody who reads nothing is no end of a program that asks again and again.
        stream.set_write_timeout(Some(timeout)).map_err(|error| Error(wording::words(error)))?;
        Ok(Self::new(Device::Tcp(stream), "tcp", timeout))
    }

    /// The CAN bus behind an adapter to which this link leads. A frame is found by its identifier in any case.
    ///
    /// # Errors
    /// The adapter does not open its channel.
    pub fn through_adapter(mut self) -> Result<Self, Error> {
        let mut adapter = Slcan::default();
        let opened = open_channel(&mut self.device, &mut adapter);
        opened.map_err(|error| Error(format!("the CAN adapter cannot be opened: {error}")))?;
        Ok(Link { framing: Box::new(adapter), name: CAN, ..self })
    }

    /// Takes the reply of any module from now on. Without this only a link to one module does, that of USB.
    pub fn take_any(&mut self) {
        self.framing.take_any();
    }

    /// Has `tap` hear all that goes over the link from now on.
    pub fn listen(&mut self, tap: Box<dyn Tap>) {
        self.tap = tap;
    }

    /// The kind of the link, as logs name it.
    pub fn name(&self) -> &'static str {
        self.name
    }
}

impl Wire for Link {
    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let Link { device, framing, timeout, tap, .. } = self;
        drop_stale(device, framing.as_mut(), tap.as_mut());
        device.flush_input()?;
        let reply = converse(device, framing.as_mut(), (address, command), *timeout, tap.as_mut());
        if let Err(LinkError::NoReply { .. } | LinkError::Others { .. }) = reply {
            tap.give_up();
        }
        tap.check().map_err(LinkError::Log)?;
        reply
    }

    fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    fn time(&self) -> Duration {
        self.opened.elapsed()
    }

    fn pause(&mut self, time: Duration, stop: &dyn Stop) -> bool {
        stop.within(time)
    }
}
