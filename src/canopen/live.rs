//! The readings of the last millisecond's turn, which PDOs and SDO uploads carry. They change all at once, at the end
//! of a turn, so that they trigger a PDO at most once in a turn.

use super::object::Object;
use super::values::Values;
use crate::device::{Circuit, Device};
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

/// The readings of the last turn.
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
    /// The built-in encoder is connected.
    pub(super) has_encoder: bool,
    /// The motor's way in both directions since the start, in microsteps.
    pub(super) way: u64,
}

impl Live {
    /// The readings that a device has taken, with the way that the motor has made. None of them takes a datagram.
    pub(super) fn of<T: Circuit>(device: &mut Device<T, 1>, way: u64) -> Self {
        let inputs = device.inputs();
        let (digital, [analog, ..]) = (inputs.digital, inputs.analog);
        let [left, right] = device.stop_switches(0).unwrap_or_default();
        let Some(mut axis) = device.axis(0) else { return Live::default() };
        let mut read = |parameter| axis.read(parameter).unwrap_or_default();
        let (encoder, load) = (read(P::EncoderPosition), read(P::ActualLoad));
        Live {
            position: axis.state().last_position(),
            speed: axis.state().last_speed(),
            encoder,
            load: load as u16,
            flags: axis.readings().flags,
            switches: [left, right, axis.state().home_switch()],
            inputs: digital,
            analog,
            has_encoder: has_encoder(device),
            way,
        }
    }

    /// Takes what a device has read since. True if it is something else.
    pub(super) fn take<T: Circuit>(&mut self, device: &mut Device<T, 1>) -> bool {
        let live = Live::of(device, self.way);
        let changes = live != *self;
        *self = live;
        changes
    }

    /// Notes the way from a position that the motor had before.
    pub(super) const fn count_way(&mut self, from: i32) {
        self.way = self.way.wrapping_add(self.position.wrapping_sub(from).unsigned_abs() as u64);
    }

    /// The actual position in microsteps, by the sensor that 606Ah selects.
    pub(super) fn actual_position(&self, values: &Values) -> i32 {
        if values.of_object(Object::SensorSelection) == 0 { self.encoder } else { self.position }
    }

    /// The following error (60F4h): the counter of the motor less the encoder, in microsteps; 0 without an encoder.
    pub(super) const fn following_error(&self) -> i32 {
        if self.has_encoder { self.position.wrapping_sub(self.encoder) } else { 0 }
    }
}

/// True if the built-in encoder is connected.
pub(super) fn has_encoder<T: Circuit>(device: &Device<T, 1>) -> bool {
    device.inputs().axes.iter().all(|sensors| sensors.encoder.is_some())
}
