//! The readings of the last millisecond's turn, which PDOs and SDO uploads carry. They change all at once, at the end
//! of a turn, so that they trigger a PDO at most once in a turn.

use crate::device::{Board, Device};
use crate::param::AxisParameter as P;

/// The flags of the driver.
pub(super) mod flags {
    /// The driver is shut down by over-temperature.
    pub(crate) const OVERTEMPERATURE: u32 = 1 << 1;
    /// The driver is close to that.
    pub(crate) const WARNING: u32 = 1 << 2;
    /// Short to ground at bridge A.
    pub(crate) const SHORT_A: u32 = 1 << 3;
    /// Short to ground at bridge B.
    pub(crate) const SHORT_B: u32 = 1 << 4;
    /// Open load at bridge A.
    pub(crate) const OPEN_A: u32 = 1 << 5;
    /// Open load at bridge B.
    pub(crate) const OPEN_B: u32 = 1 << 6;
}

/// What was read in the last turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Live {
    /// The counter of the ramp generator, in microsteps.
    pub(super) position: i32,
    /// Speed of the ramp generator, in internal units, right if positive.
    pub(super) speed: i32,
    /// The built-in encoder, in microsteps.
    pub(super) encoder: i32,
    /// The load value of the driver.
    pub(super) load: u16,
    /// The [flags] of the driver.
    pub(super) flags: u32,
    /// Left and right stop switch, true is closed; and the home switch, true is a high input.
    pub(super) switches: [bool; 3],
    /// The digital inputs, IN0 in bit 0.
    pub(super) inputs: u16,
    /// Analog input 0.
    pub(super) analog: u16,
}

impl Live {
    /// The readings that a device has taken. None of them takes a datagram.
    pub(super) fn of<T: Board>(device: &mut Device<T, 1>) -> Self {
        let inputs = device.inputs();
        let (digital, [analog, ..]) = (inputs.digital, inputs.analog);
        let [left, right] = device.stop_switches(0).unwrap_or_default();
        let Some(mut axis) = device.axis(0) else { return Live::default() };
        let mut read = |parameter| axis.read(parameter).unwrap_or_default();
        let (encoder, load) = (read(P::EncoderPosition), read(P::ActualLoad));
        Live {
            position: axis.last_position(),
            speed: axis.last_speed(),
            encoder,
            load: load as u16,
            flags: axis.last_flags(),
            switches: [left, right, axis.home_switch()],
            inputs: digital,
            analog,
        }
    }
}
