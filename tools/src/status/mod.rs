//! Readings of a module's inputs, outputs and axes, and what the readings mean, in words.
//!
//! Nothing here sends anything but [`read_latched`]: whoever shows a status samples the commands of [`ports`] and
//! [`requests`], and has their values told.

mod axis;
mod driver;
mod latched;
mod line;
mod port;
mod quantity;
mod scale;

pub use axis::words;
pub(crate) use driver::{DRIVER_FLAGS, STANDSTILL};
pub(crate) use latched::EXTENDED_FLAGS;
pub use latched::{latched, latches, read_latched};
pub use line::{Line, Severity};
pub use port::{Kind, Port, Switch, ports};
pub use quantity::requests;
pub use scale::Scale;

#[cfg(test)]
mod tests;
