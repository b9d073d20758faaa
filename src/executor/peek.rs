//! Values that are looked at past all links.

use super::{Commands, Outcome, Product};
use crate::device::Board;
use crate::param::AxisParameter;
use crate::tmcl::{Command, Opcode, Status};

/// The kind of RFS that asks for the status of a reference search, and begins or ends none (manual section 3.7.11).
const SEARCH_STATUS: u8 = 2;

impl<T: Board<Product: Product>, const AXES: usize> Commands<'_, T, AXES> {
    /// What a command that only reads would read. Whether a position is reached is told by the last reading, so that no chip is
    /// asked for it.
    pub(crate) fn peek(&mut self, opcode: Opcode, command: Command) -> Result<i32, Status> {
        let Command { kind, motor, .. } = command;
        let outcome = match opcode {
            Opcode::Gap if reads::<T::Product>(kind, AxisParameter::PositionReached) => {
                return Ok(self.axis(motor)?.state().at_target().into());
            }
            Opcode::Gap => return self.get_axis(kind, motor),
            Opcode::Ggp => return self.get_global(kind, motor),
            Opcode::Gio => self.get_input(kind, motor)?,
            Opcode::Rfs if kind == SEARCH_STATUS => self.reference_search(kind, motor, 0)?,
            _ => return Err(Status::NotAvailable),
        };
        match outcome {
            Outcome::Read(value) => Ok(value),
            _ => Err(Status::NotAvailable),
        }
    }
}

/// Whether a number is that of an axis parameter.
fn reads<P: Product>(number: u8, function: AxisParameter) -> bool {
    P::SPEC.axis.find(number).is_some_and(|parameter| parameter.function == function)
}
