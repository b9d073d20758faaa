//! The way to modules: requests go out, replies come in, and time passes.

pub mod framing;
mod tap;
mod virtual_module;

use std::error::Error;
use std::fmt;
use std::time::Duration;

use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{TELEGRAM, Telegram};
use tmcm_sim::NativeModule;

use crate::stop::Stop;
pub use tap::{Nobody, Tap};
pub use virtual_module::VirtualWire;

/// An open link to one module or several: a device of an operating system, a port of a browser, or a virtual module.
/// All calls block.
pub trait Wire {
    /// Sends a command to a module and waits for the reply. Bytes that came before the request are thrown away.
    ///
    /// # Errors
    /// No reply has come, or the link has failed.
    fn exchange(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError>;

    /// Sets the longest wait for a reply.
    fn set_timeout(&mut self, timeout: Duration);

    /// Time since the link was opened: that of the clock on the wall, of a virtual module its virtual time.
    fn time(&self) -> Duration;

    /// Lets time pass for the module, or until `stop` is asked. True if it has been asked.
    fn pause(&mut self, time: Duration, stop: &dyn Stop) -> bool;

    /// The virtual module to which the link leads, if it is one inside this program.
    fn simulated(&mut self) -> Option<&mut NativeModule> {
        None
    }
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
    Log(Box<dyn Error + Send + Sync>),
    /// The device or the connection has failed: how, in words.
    Lost(String),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::NoReply { bytes: 0 } => {
                f.write_str("no reply; check power, wiring, address, and on RS485 bit rate and termination")
            }
            LinkError::NoReply { bytes } => {
                write!(f, "only {bytes} of {TELEGRAM} bytes of a reply came; on RS485 check the bit rate")
            }
            LinkError::Others { asked, answered } => {
                let (plural, others) = (if answered.len() == 1 { "" } else { "s" }, numbers(answered));
                write!(
                    f,
                    "no reply from module {asked}, but module{plural} {others} answered; use its address, or take replies from \
                     any address if the module asked is the only one, or has {asked} for its secondary address"
                )
            }
            LinkError::Address => f.write_str("addresses go up to 255 on this link; only CAN has more, up to 2047"),
            LinkError::Refused => f.write_str("the adapter refused the frame; check its power and the bus"),
            LinkError::Closed => {
                f.write_str("the other side has closed the connection; check the power of the module, and its cable")
            }
            LinkError::Log(error) => error.fmt(f),
            LinkError::Interrupted { signal } => write!(f, "signal {signal} came before a reply"),
            LinkError::Lost(how) => write!(f, "the link failed: {how}"),
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

impl Error for LinkError {}
