//! Digital and analog inputs and outputs: SIO and GIO (manual sections 3.7.14, 3.7.15).

use super::outcome::Outcome;
use super::{Module, Platform, Spec};
use crate::tmcl::Status;

/// The time that the status LED is on, and then off, in milliseconds.
pub(super) const BLINK_MS: u64 = 1000;
/// Number of digital inputs: IN0 to IN3.
const INPUTS: usize = 4;
/// The port number of SIO and GIO that stands for all ports of a bank.
const ALL: u8 = 255;
/// How far from its absolute zero the built-in encoder still counts as there, for GIO 11, 0; in 1/1024 turn.
const NEAR_ZERO: u16 = 4;

/// The signals at the module's inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Levels of IN0..IN3; IN1 is also the left stop switch, IN2 the right one, IN3 home.
    pub digital: [bool; INPUTS],
    /// Analog value of IN0, 0..=4095 of the converter's 12 bits.
    pub analog: u16,
    /// Supply voltage in 0.1 V; `None` on a board that does not measure it.
    pub supply: Option<u16>,
    /// Temperature in degrees Celsius.
    pub temperature: i16,
    /// SG_TST output of the driver: high while the load value is zero, so that the motor stalls.
    pub stall: bool,
    /// Angle of the built-in encoder, 0..=1023 in a turn.
    pub encoder: u16,
    /// Counter of the external ABN encoder, wrapping at 16 bits.
    pub external: u16,
    /// Counts of the external encoder at which its N track last became low, and high, since the poll before.
    pub null: [Option<u16>; 2],
}

/// The signals that the module wants at its outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// General purpose outputs, OUT0 in bit 0.
    pub digital: u8,
    /// Pull-up resistors of IN1..IN3.
    pub pull_ups: bool,
    /// Status LED.
    pub led: bool,
    /// Error LED: lit when the motion controller does not answer.
    pub trouble: bool,
    /// The firmware is to start anew: all replies that go out before it have been handed to their links.
    pub restart: bool,
}

impl Default for Outputs {
    /// Outputs low, pull-ups on, as after power-on.
    fn default() -> Self {
        Outputs { digital: 0, pull_ups: true, led: false, trouble: false, restart: false }
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    pub(super) fn set_output(&mut self, port: u8, bank: u8, value: i32) -> Result<Outcome, Status> {
        let all = 1_u8.checked_shl(self.spec().outputs.into()).unwrap_or(0).wrapping_sub(1);
        match (bank, port) {
            // Published configuration tools write 3 to every module, the default of sisters with two pull-up groups; so 3 is
            // accepted, and bit 0 decides.
            (0, 0) if self.spec().pull_ups == 0 => return Err(Status::WrongType),
            (0, 0) if (0..=3).contains(&value) => self.outputs.pull_ups = value & 1 != 0,
            (0, 0) => return Err(Status::InvalidValue),
            (2, ALL) => {
                let bits = if value == -1 { self.machine.registers.accumulator } else { value };
                // Bits of outputs that the product does not have are ignored, in a constant as in the accumulator.
                if value != -1 && !(0..=255).contains(&value) {
                    return Err(Status::InvalidValue);
                }
                self.outputs.digital = (bits & i32::from(all)) as u8;
            }
            (2, port) if port < self.spec().outputs => {
                let bit = 1_u8.checked_shl(port.into()).unwrap_or(0);
                if flag(value)? {
                    self.outputs.digital |= bit;
                } else {
                    self.outputs.digital &= !bit;
                }
            }
            (0 | 2, _) => return Err(Status::WrongType),
            _ => return Err(Status::InvalidValue),
        }
        Ok(Outcome::Value(value))
    }

    pub(super) fn get_input(&self, port: u8, bank: u8) -> Result<Outcome, Status> {
        let Spec { inputs, outputs, analog, .. } = *self.spec();
        let digital = self.inputs.digital.get(..usize::from(inputs)).unwrap_or(&self.inputs.digital);
        let value = match (bank, port) {
            (0, ALL) => digital.iter().rev().fold(0, |bits, level| bits << 1 | i32::from(*level)),
            (0, 11) => {
                let angle = self.inputs.encoder;
                let turn = crate::chip::encoder::TURN;
                (angle.min(turn.saturating_sub(angle)) <= NEAR_ZERO).into()
            }
            (0, port) => (*digital.get(usize::from(port)).ok_or(Status::WrongType)?).into(),
            (1, 0) if analog & 1 != 0 => self.inputs.analog.into(),
            (1, 8) => self.inputs.supply.ok_or(Status::NotAvailable)?.into(),
            (1, 9) => self.inputs.temperature.into(),
            (2, port) if port < outputs => (self.outputs.digital.unbounded_shr(port.into()) & 1).into(),
            (1 | 2, _) => return Err(Status::WrongType),
            _ => return Err(Status::InvalidValue),
        };
        Ok(Outcome::Read(value))
    }
}

fn flag(value: i32) -> Result<bool, Status> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Status::InvalidValue),
    }
}
