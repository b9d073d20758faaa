//! The wires of an operating system to modules, for the tools: serial devices, TCP, and serial CAN adapters (SLCAN) over either;
//! and signals that ask to end.

pub mod claim;
mod exchange;
pub mod poll;
mod question;
mod serial;
pub mod signal;
mod slcan;
mod tcp;
pub mod wording;

use std::fmt;
use std::fs::File;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use tmcl_tools::stop::Stop;
use tmcl_tools::wire::{LinkError, Nobody, Tap, Wire};
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;
use tmcm_sim::wire::CAN;

use exchange::{converse, drop_stale};
use question::Question;
use serial::Serial;
pub use signal::EndSignal;
use slcan::Slcan;
use tcp::Tcp;
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
    kind: Kind,
    timeout: Duration,
    /// The reply of any module is taken, whatever address is in it.
    takes_any: bool,
    tap: Box<dyn Tap>,
    /// When the link was opened.
    opened: Instant,
}

/// The kinds of links.
enum Kind {
    Serial(Serial),
    Tcp(Tcp),
    SlcanSerial(Slcan<File>),
    SlcanTcp(Slcan<TcpStream>),
}

impl Link {
    fn new(kind: Kind, takes_any: bool, timeout: Duration) -> Self {
        Link { kind, timeout, takes_any, tap: Box::new(Nobody), opened: Instant::now() }
    }

    /// Opens a serial device at `baud` bit/s. `timeout` is the longest wait for a reply.
    ///
    /// # Errors
    /// The device cannot be opened, or another program has it.
    pub fn serial(path: &str, baud: u32, timeout: Duration) -> Result<Self, Error> {
        let serial = Serial::open(path, baud)?;
        let is_alone = serial.is_alone();
        Ok(Self::new(Kind::Serial(serial), is_alone, timeout))
    }

    /// Connects to a TCP port that carries the bytes of a serial link. `timeout` is the longest wait for the connection, and
    /// for a reply.
    ///
    /// # Errors
    /// Nobody takes the connection.
    pub fn tcp(address: &str, timeout: Duration) -> Result<Self, Error> {
        Ok(Self::new(Kind::Tcp(Tcp::connect(address, timeout)?), false, timeout))
    }

    /// The CAN bus behind an adapter to which this link leads. A frame is found by its identifier in any case.
    ///
    /// # Errors
    /// The adapter does not open its channel.
    pub fn through_adapter(self) -> Result<Self, Error> {
        let kind = match self.kind {
            Kind::Serial(serial) => Slcan::open(serial.device).map(Kind::SlcanSerial),
            Kind::Tcp(tcp) => Slcan::open(tcp.0).map(Kind::SlcanTcp),
            adapter @ (Kind::SlcanSerial(_) | Kind::SlcanTcp(_)) => Ok(adapter),
        };
        let kind = kind.map_err(|error| Error(format!("the CAN adapter cannot be opened: {error}")))?;
        Ok(Self::new(kind, false, self.timeout))
    }

    /// Takes the reply of any module from now on. Without this only a link to one module does, that of USB.
    pub fn take_any(&mut self) {
        self.takes_any = true;
    }

    /// Has `tap` hear all that goes over the link from now on.
    pub fn listen(&mut self, tap: Box<dyn Tap>) {
        self.tap = tap;
    }

    /// What kind of link it is, in logs.
    pub fn name(&self) -> &'static str {
        match &self.kind {
            Kind::Serial(_) => "serial",
            Kind::Tcp(_) => "tcp",
            Kind::SlcanSerial(_) | Kind::SlcanTcp(_) => CAN,
        }
    }

    fn ask(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let (timeout, takes_any, tap) = (self.timeout, self.takes_any, &mut *self.tap);
        let question = || match u8::try_from(address) {
            Ok(address) => Ok(Question { address, command, takes_any }),
            Err(_) => Err(LinkError::Address),
        };
        match &mut self.kind {
            Kind::Serial(serial) => {
                let question = question()?;
                serial.forget(tap)?;
                converse(&mut serial.device, &question, timeout, tap)
            }
            Kind::Tcp(Tcp(stream)) => {
                let question = question()?;
                drop_stale(stream, tap);
                converse(stream, &question, timeout, tap)
            }
            Kind::SlcanSerial(adapter) => adapter.ask(address, command, timeout, tap),
            Kind::SlcanTcp(adapter) => adapter.ask(address, command, timeout, tap),
        }
    }
}

impl Wire for Link {
    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let reply = self.ask(address, command);
        if let Err(LinkError::NoReply { .. } | LinkError::Others { .. }) = reply {
            self.tap.give_up();
        }
        self.tap.check().map_err(LinkError::Log)?;
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
