//! The built-in encoder: what needs it, and how the counter of the motor follows it (manual section 6.1.6).
//!
//! While the bridges are off the shaft can be turned by hand, so a following error (8611h) needs a motor that is held.
//! Where one is watched for (6065h), the counter becomes what the encoder says when the motor is held again, and when a
//! fault is reset. A drive that has found its home position has not lost it by that: its encoder has counted on.

use super::plant::Plant;
use crate::canopen::cia301::abort::Abort;
use crate::canopen::entry::Entry;
use crate::canopen::live::has_encoder;
use crate::canopen::object::Object;
use crate::chip::encoder::TURN;
use crate::device::{Circuit, Device};

/// The methods that need an encoder.
const BY_INDEX: [i32; 6] = [1, 2, 3, 5, 33, 34];

/// Looks at an object that may need the built-in encoder, before it is written.
///
/// # Errors
/// The value needs an encoder, and there is none.
pub(in crate::canopen) fn check<T: Circuit>(device: &Device<T, 1>, object: Object, value: u32) -> Result<(), Abort> {
    let needs = match object {
        Object::HomingMethod => BY_INDEX.contains(&(value as i32)),
        Object::SensorSelection => value == 0,
        Object::FollowingErrorWindow => value != 0,
        _ => false,
    };
    if needs && !has_encoder(device) { Err(Abort::State) } else { Ok(()) }
}

impl<T: Circuit> Plant<'_, T> {
    /// Takes the encoder over in the first turn after the start, in which it is known whether there is one. The
    /// position of the motor becomes that of the encoder within the turn, if 200Bh asks for that. Without an encoder a
    /// saved setting that needs one counts as its default.
    pub(in crate::canopen) fn meet_encoder(&mut self) {
        for object in [Object::HomingMethod, Object::SensorSelection, Object::FollowingErrorWindow] {
            let entry = Entry::of(object);
            if check(self.device, object, self.settings.values.get(entry)).is_err() {
                self.settings.values.set(entry, entry.row().default_number(0, 0));
            }
        }
        let [sensors] = self.device.inputs().axes;
        if let Some(angle) = sensors.encoder.filter(|_| self.settings.of(Object::EncoderInitialise) != 0) {
            let microsteps =
                u64::from(angle).saturating_mul(self.settings.scale.turn().into()).checked_div(TURN.into());
            self.take_position(microsteps.unwrap_or_default() as i32);
        }
    }

    /// True if following errors are watched for, and counter and encoder are more than a full step apart.
    pub(super) fn deviates(&self) -> bool {
        let full_step = 1_u32.unbounded_shl(self.settings.of(Object::MicrostepResolution));
        let watched = self.settings.of(Object::FollowingErrorWindow) != 0;
        watched && self.live.following_error().unsigned_abs() > full_step
    }

    /// The counter of a motor that stands becomes what the encoder says, if it [deviates](Self::deviates).
    pub(super) fn follow_encoder(&mut self) {
        if self.deviates() {
            self.take_position(self.live.encoder);
        }
    }
}
