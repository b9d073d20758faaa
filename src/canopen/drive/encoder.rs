//! The built-in encoder: what needs it, how the counter of the motor follows it, and the following error (manual section
//! 6.1.6).
//!
//! While the bridges are off the shaft can be turned by hand, so a following error (8611h) needs a motor that is held. Where
//! one is watched for (6065h), the counter becomes what the encoder says when the motor is held again, and when a fault is
//! reset. A drive that has found its home position has not lost it by that: its encoder has counted on.

use crate::canopen::Node;
use crate::canopen::abort::Abort;
use crate::canopen::object::{Entry, Object};
use crate::canopen::store::Tmcm1140;
use crate::chip::encoder::TURN;
use crate::device::Board;

/// The methods that need an encoder.
const BY_INDEX: [i32; 6] = [1, 2, 3, 5, 33, 34];

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Makes `position`, in microsteps, the actual position of the motor and of its encoder. The motor stays where it is.
    pub(super) fn take_position(&mut self, position: i32) {
        let now = self.now;
        if let Some(mut axis) = self.device.axis(0) {
            // A motion controller that does not take it keeps position and encoder as they were.
            let _ = axis.set_positions(now, position);
        }
        self.read_live();
    }

    /// True if the built-in encoder is connected.
    fn has_encoder(&self) -> bool {
        self.device.inputs().axes.iter().all(|sensors| sensors.encoder.is_some())
    }

    /// Looks at an object that may need the built-in encoder, before it is written.
    ///
    /// # Errors
    /// The value needs an encoder, and there is none.
    pub(in crate::canopen) fn check_encoder(&self, object: Object, value: u32) -> Result<(), Abort> {
        let needs = match object {
            Object::HomingMethod => BY_INDEX.contains(&(value as i32)),
            Object::SensorSelection => value == 0,
            Object::FollowingErrorWindow => value != 0,
            _ => false,
        };
        if needs && !self.has_encoder() { Err(Abort::State) } else { Ok(()) }
    }

    /// Takes the encoder over in the first turn after the start, in which it is known whether there is one: the position of
    /// the motor becomes that of the encoder within the turn, if 200Bh asks for that. Without an encoder a saved setting
    /// that needs one counts as its default.
    pub(in crate::canopen) fn meet_encoder(&mut self) {
        for object in [Object::HomingMethod, Object::SensorSelection, Object::FollowingErrorWindow] {
            let entry = Entry::of(object);
            if self.check_encoder(object, self.values.get(entry)).is_err() {
                self.values.set(entry, entry.row().default_number(0, self.node));
            }
        }
        let [sensors] = self.device.inputs().axes;
        if let Some(angle) = sensors.encoder.filter(|_| self.values.of_object(Object::EncoderInitialise) != 0) {
            let microsteps = u64::from(angle).saturating_mul(self.scale.turn().into()).checked_div(TURN.into());
            self.take_position(microsteps.unwrap_or_default() as i32);
        }
    }

    /// Tells the axis how many microsteps a turn of the motor has, from which the position of the encoder follows.
    pub(in crate::canopen) fn tell_turn(&mut self) {
        let turn = self.scale.turn();
        if let Some(mut axis) = self.device.axis(0) {
            axis.set_turn(turn as i32);
        }
    }

    /// The following error (60F4h): the counter of the motor less the encoder, in microsteps; 0 without an encoder.
    pub(in crate::canopen) fn following_error(&self) -> i32 {
        if self.has_encoder() { self.live.position.wrapping_sub(self.live.encoder) } else { 0 }
    }

    /// True if a motor that is held, and may be moving, is outside the window of 6065h.
    pub(super) fn has_following_error(&self) -> bool {
        let window = self.values.of_object(Object::FollowingErrorWindow);
        let held = self.drive.held.is_some_and(|held| self.now >= held);
        held && !self.drive.turned && window != 0 && self.following_error().unsigned_abs() > window
    }

    /// True if following errors are watched for, and counter and encoder are more than a full step apart.
    pub(super) fn deviates(&self) -> bool {
        let full_step = 1_u32.unbounded_shl(self.values.of_object(Object::MicrostepResolution));
        let watched = self.values.of_object(Object::FollowingErrorWindow) != 0;
        watched && self.following_error().unsigned_abs() > full_step
    }

    /// The counter of a motor that stands becomes what the encoder says, if it [deviates](Self::deviates).
    pub(super) fn follow_encoder(&mut self) {
        if self.deviates() {
            self.take_position(self.live.encoder);
        }
    }
}
