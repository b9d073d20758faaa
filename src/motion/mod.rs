//! What an axis does: moving, stopping, holding, and the parameters that say how.

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

/// Why an axis did not do what it was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The parameter cannot be written.
    ReadOnly,
    /// The value is out of range, or the divisors admit no positioning ramp.
    OutOfRange,
    /// Not with the parameters as they are.
    NotNow,
    /// A chip did not take the datagram.
    Chip,
}

impl<E: embedded_hal::spi::Error> From<E> for Error {
    fn from(_: E) -> Self {
        Error::Chip
    }
}
