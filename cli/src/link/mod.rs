//! The host's end of a link to a module: a request goes out, its reply comes in.

mod exchange;
mod log;
mod question;
mod serial;
mod simulated;
mod slcan;
mod tcp;

use std::path::Path;
use std::time::{Duration, Instant};

use tmcl_tools::product::Product;
use tmcl_tools::stop::Stop;
use tmcl_tools::wire::{LinkError, Wire};
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;
use tmcm_sim::NativeModule;
use tmcm_sim::wire::CAN;

use crate::failure::Failure;
use crate::wording;
use log::Log;
pub use log::LogFile;
use question::Question;
use serial::Serial;
use simulated::Simulated;
pub use simulated::Surroundings;
use slcan::Slcan;
use tcp::Tcp;
pub(crate) use tcp::connect;

/// A link as it is named on the command line: the path of a serial device, `tcp:HOST:PORT`, either of these behind
/// `slcan:`, or `sim`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkTarget {
    /// A serial device: USB, an RS485 adapter, or the pseudo terminal of `tmcl sim`.
    Serial(String),
    /// A TCP port that carries the bytes of a serial link.
    Tcp(String),
    /// A serial CAN adapter, which is reached over a serial device or a TCP port.
    Slcan(Box<LinkTarget>),
    /// A virtual module inside this program, in virtual time.
    Simulated,
}

impl LinkTarget {
    /// Reads a link's name.
    ///
    /// # Errors
    /// A message that shows how a link is named.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text == "sim" {
            return Ok(LinkTarget::Simulated);
        }
        if let Some(adapter) = text.strip_prefix("slcan:") {
            let target = Self::parse(adapter).map_err(|error| error.replace("did you mean ", "did you mean slcan:"));
            return match target? {
                target @ (LinkTarget::Serial(_) | LinkTarget::Tcp(_)) => Ok(LinkTarget::Slcan(Box::new(target))),
                _ => {
                    Err("give the adapter's device, for example slcan:/dev/ttyACM0 or slcan:tcp:127.0.0.1:4142".into())
                }
            };
        }
        if let Some(address) = text.strip_prefix("tcp:") {
            let parts = address.rsplit_once(':').filter(|(host, _)| !host.is_empty());
            return match parts.map(|(_, port)| port.parse::<u16>()) {
                Some(Ok(_)) if address.starts_with('/') => {
                    Err(format!("no slashes there; did you mean tcp:{}?", address.trim_start_matches('/')))
                }
                Some(Ok(_)) => Ok(LinkTarget::Tcp(address.into())),
                _ => Err("give a host and a port, for example tcp:127.0.0.1:4140".into()),
            };
        }
        if text.is_empty() {
            return Err("give a serial device such as /dev/ttyACM0, tcp:HOST:PORT, slcan:DEVICE, or sim".into());
        }
        match meant(text).filter(|_| !Path::new(text).exists()) {
            Some(meant) => Err(format!("there is no such device; did you mean {meant}?")),
            None => Ok(LinkTarget::Serial(text.into())),
        }
    }
}

/// The link that is meant by what is no path of a device at first sight: a host and a port, or one of the words in
/// capitals, or the name of a device without its folder. `None` if it looks like a path.
fn meant(text: &str) -> Option<String> {
    let small = text.to_ascii_lowercase();
    let known = small == "sim" || ["tcp:", "slcan:"].iter().any(|beginning| small.starts_with(beginning));
    if known {
        return Some(small);
    }
    let device = Path::new("/dev").join(text);
    if !text.contains('/') && device.exists() {
        return Some(device.display().to_string());
    }
    let (host, port) = text.rsplit_once(':')?;
    let is_host = !host.is_empty() && !host.contains('/');
    (is_host && port.parse::<u16>().is_ok()).then(|| format!("tcp:{text}"))
}

/// The failure of a subcommand whose link has failed.
impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::Interrupted { signal } => Failure::Interrupted { signal, message: String::new() },
            LinkError::Log(error) => match error.downcast() {
                Ok(failure) => *failure,
                Err(error) => Failure::Failed(error.to_string()),
            },
            error => Failure::Failed(error.to_string()),
        }
    }
}

/// The error of a device or a connection, in words.
fn lost(error: impl Into<std::io::Error>) -> LinkError {
    LinkError::Lost(wording::words(error))
}

/// An open link.
#[derive(Debug)]
pub struct Link {
    kind: Kind,
    timeout: Duration,
    /// The reply of any module is taken, whatever address is in it.
    takes_any: bool,
    log: Log,
    /// When the link was opened.
    opened: Instant,
}

/// The kinds of links.
#[derive(Debug)]
enum Kind {
    Serial(Serial),
    Tcp(Tcp),
    SlcanSerial(Slcan<std::fs::File>),
    SlcanTcp(Slcan<std::net::TcpStream>),
    Simulated(Box<Simulated>),
}

impl Link {
    /// Opens a link. `baud` is the bit rate of a serial device in bit/s, `timeout` the longest wait for a reply; `product`
    /// and `surroundings` say what a virtual module inside this program is.
    ///
    /// # Errors
    /// The device or the connection cannot be opened, or a real module is to have surroundings.
    pub fn open(
        target: &LinkTarget,
        baud: u32,
        timeout: Duration,
        product: Product,
        surroundings: &Surroundings,
    ) -> Result<Self, Failure> {
        if let (Some(option), false) = (surroundings.given(), *target == LinkTarget::Simulated) {
            let message = "is for LINK sim; the module on this link has its own, which tmcl sim was given";
            return Err(Failure::Arguments(format!("{option} {message}")));
        }
        let kind = match target {
            LinkTarget::Serial(path) => Kind::Serial(Serial::open(path, baud)?),
            LinkTarget::Tcp(address) => Kind::Tcp(Tcp::connect(address, timeout)?),
            LinkTarget::Slcan(adapter) => Self::open_adapter(adapter, baud, timeout)?,
            LinkTarget::Simulated => Kind::Simulated(Box::new(Simulated::new(product, surroundings)?)),
        };
        let takes_any = match &kind {
            Kind::Serial(serial) => serial.is_alone(),
            // A frame is found by its identifier in any case.
            Kind::Tcp(_) | Kind::SlcanSerial(_) | Kind::SlcanTcp(_) => false,
            Kind::Simulated(_) => true,
        };
        Ok(Link { kind, timeout, takes_any, log: Log::default(), opened: Instant::now() })
    }

    /// Takes the reply of any module from now on. Without this only a link to one module does: that of USB, and a module
    /// inside this program.
    pub fn take_any(&mut self) {
        self.takes_any = true;
    }

    fn open_adapter(target: &LinkTarget, baud: u32, timeout: Duration) -> Result<Kind, Failure> {
        let wire = match target {
            LinkTarget::Tcp(address) => Slcan::open(Tcp::connect(address, timeout)?.0).map(Kind::SlcanTcp),
            LinkTarget::Serial(path) => Slcan::open(Serial::open(path, baud)?.device).map(Kind::SlcanSerial),
            LinkTarget::Slcan(_) | LinkTarget::Simulated => Err(lost(std::io::ErrorKind::Unsupported)),
        };
        wire.map_err(|error| Failure::Failed(format!("the CAN adapter cannot be opened: {error}")))
    }

    /// Logs from now on what goes over the link to a module, of which it may be known what it is.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn log_to(&mut self, file: &LogFile, product: Option<Product>) -> Result<(), Failure> {
        let name = match &self.kind {
            Kind::Serial(_) => "serial",
            Kind::Tcp(_) => "tcp",
            Kind::SlcanSerial(_) | Kind::SlcanTcp(_) => CAN,
            Kind::Simulated(_) => "sim",
        };
        self.log = file.begin(name, product)?;
        Ok(())
    }

    fn ask(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let (timeout, takes_any, log) = (self.timeout, self.takes_any, &mut self.log);
        let question = || match u8::try_from(address) {
            Ok(address) => Ok(Question { address, command, takes_any }),
            Err(_) => Err(LinkError::Address),
        };
        match &mut self.kind {
            Kind::Serial(serial) => serial.exchange(&question()?, timeout, log),
            Kind::Tcp(tcp) => tcp.exchange(&question()?, timeout, log),
            Kind::SlcanSerial(adapter) => adapter.ask(address, command, timeout, log),
            Kind::SlcanTcp(adapter) => adapter.ask(address, command, timeout, log),
            Kind::Simulated(module) => module.exchange(&question()?.telegram(), timeout, log),
        }
    }
}

impl Wire for Link {
    fn simulated(&mut self) -> Option<&mut NativeModule> {
        match &mut self.kind {
            Kind::Simulated(module) => Some(&mut module.0),
            _ => None,
        }
    }

    fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    fn time(&self) -> Duration {
        match &self.kind {
            Kind::Simulated(module) => module.time(),
            _ => self.opened.elapsed(),
        }
    }

    fn pause(&mut self, time: Duration, stop: &dyn Stop) -> bool {
        match &mut self.kind {
            Kind::Simulated(module) => {
                module.pass(time);
                stop.happened()
            }
            _ => stop.within(time),
        }
    }

    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let reply = self.ask(address, command);
        if let Err(LinkError::NoReply { .. } | LinkError::Others { .. }) = reply {
            let now = match &self.kind {
                Kind::Simulated(module) => module.time(),
                _ => self.log.now(),
            };
            self.log.give_up(now);
        }
        self.log.check()?;
        reply
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_of_links_are_told_apart() {
        assert_eq!(LinkTarget::parse("sim"), Ok(LinkTarget::Simulated));
        assert_eq!(LinkTarget::parse("/dev/ttyACM0"), Ok(LinkTarget::Serial("/dev/ttyACM0".into())));
        assert_eq!(LinkTarget::parse("tcp:localhost:4140"), Ok(LinkTarget::Tcp("localhost:4140".into())));
        let adapter = LinkTarget::Slcan(Box::new(LinkTarget::Serial("/dev/ttyACM0".into())));
        assert_eq!(LinkTarget::parse("slcan:/dev/ttyACM0"), Ok(adapter));
        assert!(
            ["slcan:", "slcan:sim", "slcan:slcan:x", "tcp:localhost", "tcp::4140", "tcp:localhost:x", ""]
                .iter()
                .all(|text| LinkTarget::parse(text).is_err())
        );
    }

    #[test]
    fn what_is_meant_is_suggested() {
        for (text, meant) in [
            ("127.0.0.1:4140", "tcp:127.0.0.1:4140"),
            ("[::1]:4140", "tcp:[::1]:4140"),
            ("module.local:4140", "tcp:module.local:4140"),
            ("TCP:Localhost:4140", "tcp:localhost:4140"),
            ("tcp://localhost:4140", "tcp:localhost:4140"),
            ("SIM", "sim"),
            ("null", "/dev/null"),
            ("slcan:127.0.0.1:4142", "slcan:tcp:127.0.0.1:4142"),
        ] {
            let told = LinkTarget::parse(text).unwrap_err();
            assert!(told.ends_with(&format!("did you mean {meant}?")), "{text}: {told}");
        }
        // A device that is not there yet is told when it is opened, by its path.
        let device = "/dev/serial/by-id/usb-Trinamic_TMCM-1140:1";
        assert_eq!(LinkTarget::parse(device), Ok(LinkTarget::Serial(device.into())));
    }
}
