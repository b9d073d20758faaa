//! Axes: moves, stops, reference searches and motor currents, and the axis parameters that govern them.
//!
//! An [`Axis`] keeps what it was told and what it has noticed. It reaches its chips by the trait [`Hardware`] alone,
//! which [`tmc429`] implements for the TMC429 with its TMC262 drivers, and [`tmc5160`] for the TMC5160. The device
//! polls each axis once in a millisecond ([`Joined::poll`]); between two polls the firmware gives motion commands and
//! reads and writes parameters.

mod axis;
mod calm;
mod current;
mod driving;
mod encoders;
mod foreseeable;
mod former;
mod guard;
mod hardware;
mod hold;
mod joined;
mod moves;
mod orders;
mod pace;
mod parameters;
mod plan;
mod profile;
mod ratio;
mod search;
mod searching;
mod sensors;
mod slope;
mod stall;
mod switch;
pub mod tmc429;
pub mod tmc5160;
mod turn;
mod values;

pub use axis::{Axis, Events};
pub use calm::Calm;
pub use current::Excitation;
pub use foreseeable::Foreseeable;
pub use former::Former;
pub use hardware::{
    Driver, Followed, Goal, Hardware, Known, MotionController, RampGenerator, RampMode, Readings, Shape, StopSwitches,
};
pub use joined::Joined;
pub use pace::Pace;
pub use plan::{Leg, Mark, Plan, Sought, Until};
pub use profile::Profile;
pub use ratio::Ratio;
pub use sensors::Sensors;
pub use slope::{Slope, Slopes, root};
pub use switch::{Side, Stops};
pub use values::Values;

/// The reason for which an axis has refused a command. It is as wide as a value, so that the compiler returns either of
/// them in registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Error {
    /// The parameter cannot be written.
    ReadOnly,
    /// The value is out of range, or the divisors admit no positioning ramp.
    OutOfRange,
    /// The values of other parameters do not allow the command, for example a reference search at speed 0; or the
    /// hardware does not have what is asked for.
    NotNow,
    /// A chip did not take, or did not answer, a datagram.
    Chip,
}

impl<E: embedded_hal::spi::Error> From<E> for Error {
    fn from(_: E) -> Self {
        Error::Chip
    }
}
