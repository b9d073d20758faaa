//! Digital and analog inputs and outputs: SIO and GIO (manual sections 3.7.14, 3.7.15).

use super::ports::{ALL_PORTS, ANALOG, INPUTS, OUTPUTS, Signal};
use super::{CONVERTER_BITS, Commands, Outcome, Product, Spec};
use crate::device::Circuit;
use crate::tmcl::Status;

/// How far from its absolute zero the built-in encoder still counts as there, for [`Signal::EncoderZero`]; in 1/1024
/// turn.
const NEAR_ZERO: u16 = 4;
/// The supply voltage at which the converter reads its highest value, in 0.1 V: 3.3 V behind a divider by eleven.
const SUPPLY_FULL_SCALE: i32 = 363;
/// The reading of 5 V behind a divider by two, on a converter that reads its highest value at 3.3 V.
const LOGIC_SUPPLY: i32 = 3102;
/// The highest reading of the converter.
const HIGHEST: i32 = (1 << CONVERTER_BITS) - 1;

impl<T: Circuit<Product: Product>, const AXES: usize> Commands<'_, T, AXES> {
    /// SIO: sets an output, all outputs, or the pull-up resistors of the inputs.
    pub(super) fn set_output(&mut self, port: u8, bank: u8, value: i32) -> Result<Outcome, Status> {
        let all = bits(Self::SPEC.outputs);
        match (bank, port) {
            // Published configuration tools write 3 to every module, the default of sisters with two pull-up groups; so
            // 3 is accepted, and bit 0 decides.
            (INPUTS, 0) if Self::SPEC.pull_ups == 0 => return Err(Status::WrongType),
            (INPUTS, 0) if (0..=3).contains(&value) => {
                self.device.outputs_mut().pull_ups = value as u8 & bits(Self::SPEC.pull_ups);
            }
            (INPUTS, 0) => return Err(Status::InvalidValue),
            (OUTPUTS, ALL_PORTS) => {
                let bits = if value == -1 { self.machine.registers.accumulator } else { value };
                // Bits of outputs that the product does not have are ignored, in a constant as in the accumulator.
                if value != -1 && !(0..=255).contains(&value) {
                    return Err(Status::InvalidValue);
                }
                self.device.outputs_mut().digital = (bits & i32::from(all)) as u8;
            }
            (OUTPUTS, port) if port < Self::SPEC.outputs => {
                let bit = 1_u8.checked_shl(port.into()).unwrap_or(0);
                let on = flag(value)?;
                let digital = &mut self.device.outputs_mut().digital;
                *digital = if on { *digital | bit } else { *digital & !bit };
            }
            (INPUTS | OUTPUTS, _) => return Err(Status::WrongType),
            _ => return Err(Status::InvalidValue),
        }
        Ok(Outcome::Value(value))
    }

    /// GIO: the level of an input or output, or the reading of an analog input.
    pub(super) fn get_input(&self, port: u8, bank: u8) -> Result<Outcome, Status> {
        let Spec { inputs, outputs, analog, analog_bits, signals, .. } = *Self::SPEC;
        let seen = self.device.inputs();
        let all = 1_u16.unbounded_shl(inputs.into()).wrapping_sub(1);
        let level = |levels: u16, port: u8| (levels.unbounded_shr(port.into()) & 1).into();
        let value = match (bank, port) {
            (INPUTS, ALL_PORTS) => (seen.digital & all).into(),
            (INPUTS, port) if port < inputs => level(seen.digital, port),
            (ANALOG, port) if analog.unbounded_shr(port.into()) & 1 != 0 => {
                widened(seen.analog.get(usize::from(port)).copied().unwrap_or_default(), analog_bits)
            }
            (OUTPUTS, port) if port < outputs => level(self.device.outputs().digital.into(), port),
            _ => match signals.iter().find(|signal| signal.place() == (bank, port)) {
                Some(Signal::Supply) => seen.supply.ok_or(Status::NotAvailable)?.into(),
                Some(Signal::SupplyReading) => {
                    let supply = i32::from(seen.supply.ok_or(Status::NotAvailable)?);
                    (supply.saturating_mul(HIGHEST) / SUPPLY_FULL_SCALE).min(HIGHEST)
                }
                Some(Signal::LogicSupplyReading) => LOGIC_SUPPLY,
                Some(Signal::Temperature) => seen.temperature.into(),
                Some(Signal::Enable) => level(seen.digital, port),
                Some(Signal::EncoderZero) => {
                    let angle = seen.axes.first().and_then(|sensors| sensors.encoder).unwrap_or_default();
                    let turn = crate::chip::encoder::TURN;
                    (angle.min(turn.saturating_sub(angle)) <= NEAR_ZERO).into()
                }
                None if matches!(bank, INPUTS | ANALOG | OUTPUTS) => return Err(Status::WrongType),
                None => return Err(Status::InvalidValue),
            },
        };
        Ok(Outcome::Read(value))
    }
}

/// A reading of the converter as a value of so many bits, 12 to 16: the highest reading becomes the highest value.
fn widened(reading: u16, bits: u8) -> i32 {
    let more = bits.saturating_sub(CONVERTER_BITS);
    let fraction = reading.unbounded_shr(CONVERTER_BITS.saturating_sub(more).into());
    (reading.unbounded_shl(more.into()) | fraction).into()
}

/// As many bits as a product has outputs, or groups of pull-up resistors.
fn bits(count: u8) -> u8 {
    1_u8.unbounded_shl(count.into()).wrapping_sub(1)
}

fn flag(value: i32) -> Result<bool, Status> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Status::InvalidValue),
    }
}
