//! Axes: moves, stops, reference searches and motor currents, and the axis parameters that govern them.

mod axis;
mod current;
mod guard;
mod parameters;
mod position;
pub mod ramp;
mod search;
mod searching;
mod stall;
mod switch;

pub use axis::{Axis, Events, Sensors};

/// The reason for which an axis has refused a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The parameter cannot be written.
    ReadOnly,
    /// The value is out of range, or the divisors admit no positioning ramp.
    OutOfRange,
    /// The parameters as they are do not allow it, for example a search at speed 0.
    NotNow,
    /// A chip did not take the datagram.
    Chip,
}

impl<E: embedded_hal::spi::Error> From<E> for Error {
    fn from(_: E) -> Self {
        Error::Chip
    }
}
