//! The host's end of a link to a module: a request goes out, its reply comes in.

mod exchange;
mod log;
mod question;
mod serial;
mod simulated;
mod slcan;
mod tcp;

use std::fmt;
use std::path::Path;
use std::time::{Duration, Instant};

use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{TELEGRAM, Telegram};
use tmcm_sim::NativeModule;
use tmcm_sim::wire::CAN;

use crate::failure::Failure;
use crate::product::Product;
use crate::signal::EndSignal;
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

/// The reason why a request has no reply.
#[derive(Debug)]
pub enum LinkError {
    /// No complete reply came in time.
    NoReply {
        /// Number of bytes that came.
        bytes: usize,
    },
    /// No module with the address has replied in time, but others have.
    Others {
        /// The address that was asked.
        asked: u8,
        /// The addresses in the replies.
        answered: Vec<u8>,
    },
    /// The address is above 255, which only CAN identifiers may be.
    Address,
    /// The CAN adapter has refused to send the frame.
    Refused,
    /// The other side has closed the connection.
    Closed,
    /// A signal has ended the wait for a reply that does not come.
    Interrupted {
        /// The number of the signal.
        signal: u8,
    },
    /// The log of what goes over the link cannot be written.
    Log(Failure),
    /// The device or the connection failed.
    Io(std::io::Error),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::NoReply { bytes: 0 } => {
                f.write_str("no reply; check power, wiring, --address, and on RS485 --baud and termination")
            }
            LinkError::NoReply { bytes } => {
                write!(f, "only {bytes} of {TELEGRAM} bytes of a reply came; on RS485 check --baud")
            }
            LinkError::Others { asked, answered } => {
                let (plural, others) = (if answered.len() == 1 { "" } else { "s" }, numbers(answered));
                write!(
                    f,
                    "no reply from module {asked}, but module{plural} {others} answered; give --address, or --any-address if \
                     the module asked is the only one, or has {asked} for its secondary address"
                )
            }
            LinkError::Address => f.write_str("addresses go up to 255 on this link; only CAN has more, up to 2047"),
            LinkError::Refused => f.write_str("the adapter refused the frame; check its power and the bus"),
            LinkError::Closed => {
                f.write_str("the other side has closed the connection; check the power of the module, and its cable")
            }
            LinkError::Log(failure) => failure.fmt(f),
            LinkError::Interrupted { signal } => write!(f, "signal {signal} came before a reply"),
            LinkError::Io(error) => write!(f, "the link failed: {}", wording::of(error)),
        }
    }
}

/// Numbers in words: `3, 4 and 7`.
fn numbers(all: &[u8]) -> String {
    let all: Vec<String> = all.iter().map(u8::to_string).collect();
    match all.split_last() {
        Some((last, before)) if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => all.concat(),
    }
}

impl std::error::Error for LinkError {}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::Interrupted { signal } => Failure::Interrupted { signal, message: String::new() },
            LinkError::Log(failure) => failure,
            error => Failure::Failed(error.to_string()),
        }
    }
}

impl From<std::io::Error> for LinkError {
    fn from(error: std::io::Error) -> Self {
        LinkError::Io(error)
    }
}

/// An open link.
#[derive(Debug)]
pub struct Link {
    wire: Wire,
    timeout: Duration,
    /// The reply of any module is taken, whatever address is in it.
    takes_any: bool,
    log: Log,
    /// When the link was opened.
    opened: Instant,
}

/// The kinds of links.
#[derive(Debug)]
enum Wire {
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
        let wire = match target {
            LinkTarget::Serial(path) => Wire::Serial(Serial::open(path, baud)?),
            LinkTarget::Tcp(address) => Wire::Tcp(Tcp::connect(address, timeout)?),
            LinkTarget::Slcan(adapter) => Self::open_adapter(adapter, baud, timeout)?,
            LinkTarget::Simulated => Wire::Simulated(Box::new(Simulated::new(product, surroundings)?)),
        };
        let takes_any = match &wire {
            Wire::Serial(serial) => serial.is_alone(),
            // A frame is found by its identifier in any case.
            Wire::Tcp(_) | Wire::SlcanSerial(_) | Wire::SlcanTcp(_) => false,
            Wire::Simulated(_) => true,
        };
        Ok(Link { wire, timeout, takes_any, log: Log::default(), opened: Instant::now() })
    }

    /// Takes the reply of any module from now on. Without this only a link to one module does: that of USB, and a module
    /// inside this program.
    pub fn take_any(&mut self) {
        self.takes_any = true;
    }

    fn open_adapter(target: &LinkTarget, baud: u32, timeout: Duration) -> Result<Wire, Failure> {
        let wire = match target {
            LinkTarget::Tcp(address) => Slcan::open(Tcp::connect(address, timeout)?.0).map(Wire::SlcanTcp),
            LinkTarget::Serial(path) => Slcan::open(Serial::open(path, baud)?.device).map(Wire::SlcanSerial),
            LinkTarget::Slcan(_) | LinkTarget::Simulated => Err(LinkError::Io(std::io::ErrorKind::Unsupported.into())),
        };
        wire.map_err(|error| Failure::Failed(format!("the CAN adapter cannot be opened: {error}")))
    }

    /// Logs from now on what goes over the link to a module, of which it may be known what it is.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn log_to(&mut self, file: &LogFile, product: Option<Product>) -> Result<(), Failure> {
        let name = match &self.wire {
            Wire::Serial(_) => "serial",
            Wire::Tcp(_) => "tcp",
            Wire::SlcanSerial(_) | Wire::SlcanTcp(_) => CAN,
            Wire::Simulated(_) => "sim",
        };
        self.log = file.begin(name, product)?;
        Ok(())
    }

    /// The virtual module inside this program, if the link leads to one.
    pub fn simulated(&mut self) -> Option<&mut NativeModule> {
        match &mut self.wire {
            Wire::Simulated(module) => Some(&mut module.0),
            _ => None,
        }
    }

    /// Sets the longest wait for a reply.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// Time since the link was opened: that of the clock on the wall, of a virtual module inside this program its virtual
    /// time.
    pub fn time(&self) -> Duration {
        match &self.wire {
            Wire::Simulated(module) => module.time(),
            _ => self.opened.elapsed(),
        }
    }

    /// Lets time pass for the module, or until a signal comes. True if a signal has come.
    pub fn pause(&mut self, time: Duration, signal: &EndSignal) -> bool {
        match &mut self.wire {
            Wire::Simulated(module) => {
                module.pass(time);
                signal.happened()
            }
            _ => signal.within(time),
        }
    }

    /// Sends a command to a module and waits for the reply. Bytes that came before the request are thrown away.
    ///
    /// # Errors
    /// No reply has come, or the link has failed.
    pub fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let reply = self.ask(address, command);
        if let Err(LinkError::NoReply { .. } | LinkError::Others { .. }) = reply {
            let now = match &self.wire {
                Wire::Simulated(module) => module.time(),
                _ => self.log.now(),
            };
            self.log.give_up(now);
        }
        self.log.check()?;
        reply
    }

    fn ask(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let (timeout, takes_any, log) = (self.timeout, self.takes_any, &mut self.log);
        let question = || match u8::try_from(address) {
            Ok(address) => Ok(Question { address, command, takes_any }),
            Err(_) => Err(LinkError::Address),
        };
        match &mut self.wire {
            Wire::Serial(serial) => serial.exchange(&question()?, timeout, log),
            Wire::Tcp(tcp) => tcp.exchange(&question()?, timeout, log),
            Wire::SlcanSerial(adapter) => adapter.ask(address, command, timeout, log),
            Wire::SlcanTcp(adapter) => adapter.ask(address, command, timeout, log),
            Wire::Simulated(module) => module.exchange(&question()?.telegram(), timeout, log),
        }
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
