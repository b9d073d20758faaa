//! The encoders of an axis: the built-in one on the motor's shaft, and an external one on its stage.

use super::sensors::Sensors;
use super::values::Values;
use crate::chip::encoder::{Counter, TURN};
use crate::param::AxisParameter as P;

/// Bits of parameter 210 that are functions, not prescaler. The manual reserves the lowest four bits (section 6.2.1),
/// but only [`CLEAR`] has a function (section 6.2.2), and in the manual's own table 20 the prescaler of two microsteps,
/// 200, has bit 3 set.
const ENCODER_FUNCTIONS: i32 = CLEAR;
/// Bits of parameter 217 that are functions, not prescaler (manual section 6.3).
const EXTERNAL_FUNCTIONS: i32 = 0x1C;
/// Parameters 210 and 217: clear the counter at the absolute zero point, or at an N event.
const CLEAR: i32 = 4;
/// Parameter 217: at every N event, not only at the next.
const CLEAR_ALWAYS: i32 = 8;
/// Parameter 217: the N event is the track becoming high, not low.
const NULL_HIGH: i32 = 16;

/// Modulus of the ABN counter.
const ABN_COUNTS: u32 = 1 << 16;

/// Both encoders of an axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Encoders {
    /// The built-in one.
    pub built_in: Counter<{ TURN as u32 }>,
    /// The external one.
    pub external: Counter<ABN_COUNTS>,
    /// The shaft is reversed, and the encoders count the other way.
    pub reverse: bool,
    /// The external encoder is to be zeroed at its next N event.
    null_armed: bool,
    /// The built-in encoder has passed its zero point in the last poll.
    pub index: bool,
}

impl Encoders {
    /// Takes both on by one poll.
    pub(super) fn count(&mut self, sensors: Sensors, values: &Values) {
        let Sensors { encoder, external, null, .. } = sensors;
        let setting = values.get(P::EncoderPrescaler);
        let prescaler = setting & !ENCODER_FUNCTIONS;
        self.index = self.built_in.update(encoder.into(), prescaler, self.reverse);
        if self.index && setting & CLEAR != 0 {
            self.built_in.zero_at(0, prescaler, self.reverse);
        }
        let setting = values.get(P::ExternalEncoderPrescaler);
        let prescaler = setting & !EXTERNAL_FUNCTIONS;
        self.external.update(external.into(), prescaler, self.reverse);
        let [low, high] = null;
        let event = if setting & NULL_HIGH != 0 { high } else { low };
        if let Some(count) = event.filter(|_| self.null_armed) {
            self.external.zero_at(count.into(), prescaler, self.reverse);
            self.null_armed = setting & CLEAR_ALWAYS != 0;
        }
    }

    /// Lets the next N event zero the external encoder, if parameter 217 asks for it.
    pub(super) fn arm_null(&mut self, values: &Values) {
        self.null_armed = values.get(P::ExternalEncoderPrescaler) & CLEAR != 0;
    }

    /// Makes both zero.
    pub(super) fn zero(&mut self) {
        self.built_in.set(0);
        self.external.set(0);
    }

    /// Deviation supervision (parameters 212 and 218): true if one of them is too far from `position`, in microsteps.
    /// A limit of 0 switches it off.
    pub(super) fn deviate(&self, position: i32, values: &Values) -> bool {
        let far = |counted: i32, limit: P| {
            let limit = values.get(limit).unsigned_abs();
            limit != 0 && position.wrapping_sub(counted).unsigned_abs() > limit
        };
        far(self.built_in.position(), P::MaximumEncoderDeviation)
            || far(self.external.position(), P::MaximumExternalEncoderDeviation)
    }
}
