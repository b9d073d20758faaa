//! The driver of an axis, which makes coil currents of step pulses and measures the load of the motor.

use crate::motion::Error;
use crate::motion::current::Excitation;
use crate::motion::values::Values;

/// The driver of an axis.
///
/// # Errors
/// A function fails where a chip does not take a datagram or does not answer one. Calling it once more is right in any
/// case.
pub trait Driver {
    /// Brings the driver's registers to the parameters and this excitation.
    fn drive(&mut self, values: &Values, excitation: Excitation) -> Result<(), Error>;

    /// Notes that the driver may have lost its registers: the next [`drive`](Self::drive) writes all of them.
    fn forget(&mut self);

    /// True if the motor stalls, by the driver's last measurement of its load. `pin` is the level of the driver's
    /// output for this, on a driver that has such an output.
    fn stalled(&self, pin: bool) -> bool;

    /// Has the hardware stop the motor at once when it stalls, where it can do so itself, or no longer do so. True if
    /// it has stopped the motor, which then stands until it is told to [stop](super::RampGenerator::stop).
    fn watch_stall(&mut self, armed: bool) -> Result<bool, Error> {
        let _ = armed;
        Ok(false)
    }
}
