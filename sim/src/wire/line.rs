//! The columns of a line in the log.

use std::fmt;

use hal_sim::clock::{MICROSECOND, Nanos, SECOND};
use tmcm::can::{CanFrame, Frame, Id};

use super::answer::hexadecimal;
use crate::client::Client;

/// Widths of the columns in characters. What is longer pushes the rest of its line to the right.
const PLACE: usize = 8;
const BYTES: usize = 27;

/// Where something goes over: a link, and where several hosts share it the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The name of the link, such as `usb`.
    pub link: &'static str,
    /// The host that shares the link with others.
    pub client: Option<Client>,
}

impl Place {
    /// A link that nobody shares.
    pub const fn alone(link: &'static str) -> Self {
        Place { link, client: None }
    }

    /// A link of one of several hosts.
    pub const fn of(link: &'static str, client: Client) -> Self {
        Place { link, client: Some(client) }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.client {
            Some(Client(number)) => f.pad(&format!("{} {number}", self.link)),
            None => f.pad(self.link),
        }
    }
}

/// The direction in which something goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    /// From a host to the modules.
    Out,
    /// From a module to the hosts.
    Back,
}

/// A line, without its end. `at` is the time in nanoseconds, which is shown in seconds with six digits.
pub(super) fn line(at: Nanos, place: Place, way: Direction, bytes: &str, meaning: &str) -> String {
    let (seconds, micros) = (at / SECOND, at % SECOND / MICROSECOND);
    let arrow = match way {
        Direction::Out => '>',
        Direction::Back => '<',
    };
    format!("{seconds:>5}.{micros:06}  {place:<PLACE$} {arrow}  {bytes:<BYTES$}  {meaning}")
}

/// The identifier of a frame, with three digits or eight, and its data; of a remote frame the length.
pub(super) fn frame(frame: &Frame) -> String {
    let id = match frame.id() {
        Id::Standard(id) => format!("{:03X}", id.as_raw()),
        Id::Extended(id) => format!("{:08X}", id.as_raw()),
    };
    match (frame.is_remote_frame(), frame.data()) {
        (true, _) => format!("{id} remote, {} bytes", frame.dlc()),
        (false, []) => id,
        (false, data) => format!("{id} {}", hexadecimal(data)),
    }
}
