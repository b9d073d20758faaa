//! The two encoders of an axis: the built-in one on the motor's shaft, and an external ABN encoder, for example on the
//! stage. Their positions are in microsteps (manual chapter 6).

use super::sensors::Sensors;
use super::values::Values;
use crate::chip::encoder::{Counter, TURN};
use crate::param::AxisParameter as P;

/// The bits of parameter 210 that are functions; the others are the prescaler. The manual reserves the lowest four bits
/// (section 6.2.1), but only [`CLEAR`] has a function (section 6.2.2). In the manual's own table 20 the prescaler of
/// two microsteps, 200, has bit 3 set.
const ENCODER_FUNCTIONS: i32 = CLEAR;
/// The bits of parameter 217 that are functions (manual section 6.3); the others are the prescaler.
const EXTERNAL_FUNCTIONS: i32 = 0x1C;
/// Function bit: the position becomes zero at the built-in encoder's absolute zero point (parameter 210), or at the
/// next N event of the external encoder (parameter 217).
const CLEAR: i32 = 4;
/// Function bit of parameter 217: the position becomes zero at every N event, not only at the next.
const CLEAR_ALWAYS: i32 = 8;
/// Function bit of parameter 217: the N event is the N track becoming high, not low.
const NULL_HIGH: i32 = 16;

/// Number of counts after which the hardware's ABN counter wraps.
const ABN_COUNTS: u32 = 1 << 16;

/// Both encoders of an axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Encoders {
    /// The built-in encoder.
    pub built_in: Counter<{ TURN as u32 }>,
    /// The external encoder.
    pub external: Counter<ABN_COUNTS>,
    /// Microsteps in a turn of the motor, from which the position of the built-in encoder follows; with `None` it
    /// follows from the prescaler of parameter 210.
    pub turn: Option<i32>,
    /// The motor's shaft is reversed (global parameter 90), so that both encoders count the other way.
    pub reverse: bool,
    /// The external encoder is to be zeroed at its next N event.
    null_armed: bool,
    /// The built-in encoder has passed its absolute zero point since this was last taken.
    pub index: bool,
}

impl Encoders {
    /// Takes in the counts that this poll has sampled.
    pub(super) fn count(&mut self, sensors: Sensors, values: &Values) {
        let Sensors { encoder, external, null, .. } = sensors;
        let setting = values.get(P::EncoderPrescaler);
        let prescaler = self.prescaler(values);
        // Without an encoder nothing is counted.
        if self.built_in.update(encoder.unwrap_or_default().into(), prescaler, self.reverse) {
            self.index = true;
            if setting & CLEAR != 0 {
                self.built_in.zero_at(0, prescaler, self.reverse);
            }
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

    /// Lets the next N event make the external encoder's position zero, if parameter 217 has [`CLEAR`] set.
    pub(super) fn arm_null(&mut self, values: &Values) {
        self.null_armed = values.get(P::ExternalEncoderPrescaler) & CLEAR != 0;
    }

    /// The built-in encoder's microsteps per count, in units of 1/512.
    fn prescaler(&self, values: &Values) -> i32 {
        // A turn is twice as many counts as a microstep has parts.
        self.turn.map_or(values.get(P::EncoderPrescaler) & !ENCODER_FUNCTIONS, |turn| turn / 2)
    }

    /// How far the motor has turned, at least, since the built-in encoder was at its absolute zero point, in
    /// microsteps. `angle` is less than half a turn from there. A count begins at its lower end, so that the motor
    /// passes the zero point between the counts -1 and 0.
    pub(super) fn beyond_index(&self, angle: u16, values: &Values) -> i32 {
        let last = i32::from(TURN) - 1;
        let counts = if angle < TURN / 2 { i32::from(angle) } else { i32::from(angle) - last };
        let way = i64::from(counts) * i64::from(self.prescaler(values));
        (if self.reverse { -way } else { way }).div_euclid(512) as i32
    }

    /// Makes the positions of both encoders this one, in microsteps.
    pub(super) fn set(&mut self, position: i32) {
        self.built_in.set(position);
        self.external.set(position);
    }

    /// True if the deviation of an encoder is supervised.
    pub(super) fn are_supervised(&self, values: &Values) -> bool {
        [P::MaximumEncoderDeviation, P::MaximumExternalEncoderDeviation].into_iter().any(|limit| values.get(limit) != 0)
    }

    /// Deviation supervision: true if the motor's `position`, in microsteps, is further from the position of an encoder
    /// than parameter 212 (built-in) or 218 (external) allows. A limit of 0 switches the supervision of that encoder
    /// off.
    pub(super) fn deviate(&self, position: i32, values: &Values) -> bool {
        let far = |counted: i32, limit: P| {
            let limit = values.get(limit).unsigned_abs();
            limit != 0 && position.wrapping_sub(counted).unsigned_abs() > limit
        };
        far(self.built_in.position(), P::MaximumEncoderDeviation)
            || far(self.external.position(), P::MaximumExternalEncoderDeviation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::param::{AxisParameter, Table, rows};

    /// The prescaler alone, with a default of 50 microsteps for each count.
    static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(rows! { AxisParameter;
        210 EncoderPrescaler "" Prescaler &[(0, i32::MAX)], ReadWrite Volatile 25600 "",
    });

    /// 1024 counts in a turn of 51 200 microsteps: 50 microsteps each, by the default of parameter 210 or by the turn.
    /// Up to the half of a turn the zero point has been passed to the right, in the other half to the left. There it
    /// lies between the counts 1023 and 0.
    #[test]
    fn the_way_since_the_zero_point_follows_from_the_angle() {
        let values = Values::of(&AXIS);
        for (angle, way) in [(0, 0), (1, 50), (300, 15_000), (511, 25_550), (512, -25_550), (722, -15_050), (1023, 0)] {
            for turn in [None, Some(51_200)] {
                let mut encoders = Encoders { turn, ..Encoders::default() };
                assert_eq!(encoders.beyond_index(angle, &values), way, "{angle}");
                encoders.reverse = true;
                assert_eq!(encoders.beyond_index(angle, &values), -way, "{angle}, reversed");
            }
        }
    }
}
