//! Links as users name them: wires of the operating system, and virtual modules inside this program.

mod log;
mod simulated;

use std::path::Path;
use std::time::Duration;

use tmcl_tools::product::Product;
use tmcl_tools::wire::{LinkError, VirtualWire, Wire};

use crate::failure::Failure;
pub use log::LogFile;
pub use simulated::Surroundings;

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

/// The link that is meant by what is no path of a device at first sight. Such a text is a host and a port, or one of
/// the words in capitals, or the name of a device without its folder. `None` if it looks like a path.
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

/// An open link: a wire of the operating system, or a virtual module inside this program.
pub(crate) enum Link {
    Real(tmcl_link::Link),
    Simulated(Box<VirtualWire>),
}

impl Link {
    /// Opens a link. `baud` is the bit rate of a serial device in bit/s, `timeout` the longest wait for a reply;
    /// `product` and `surroundings` say what a virtual module inside this program is.
    ///
    /// # Errors
    /// The device or the connection cannot be opened, or a real module is to have surroundings.
    pub(crate) fn open(
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
        Ok(match target {
            LinkTarget::Serial(path) => Link::Real(tmcl_link::Link::serial(path, baud, timeout)?),
            LinkTarget::Tcp(address) => Link::Real(tmcl_link::Link::tcp(address, timeout)?),
            LinkTarget::Slcan(adapter) => match Self::open(adapter, baud, timeout, product, surroundings)? {
                Link::Real(adapter) => Link::Real(adapter.through_adapter()?),
                simulated @ Link::Simulated(_) => simulated,
            },
            LinkTarget::Simulated => Link::Simulated(Box::new(simulated::open(product, surroundings, timeout)?)),
        })
    }

    /// Takes the reply of any module from now on. Without this only a link to one module does: that of USB, and a
    /// module inside this program.
    pub(crate) fn take_any(&mut self) {
        if let Link::Real(link) = self {
            link.take_any();
        }
    }

    /// Logs from now on what goes over the link to a module, of which it may be known what it is.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn log_to(&mut self, file: &LogFile, product: Option<Product>) -> Result<(), Failure> {
        match self {
            Link::Real(link) => {
                let log = file.begin(link.name(), product)?;
                link.listen(Box::new(log));
            }
            Link::Simulated(module) => module.listen(Box::new(file.begin("sim", product)?)),
        }
        Ok(())
    }

    /// The link as the tools use it.
    pub(crate) fn wire(self) -> Box<dyn Wire> {
        match self {
            Link::Real(link) => Box::new(link),
            Link::Simulated(module) => module,
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
