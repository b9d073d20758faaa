//! Whether a command may be executed, as far as its row of the instruction table and the product tell.

use super::Product;
use crate::tmcl::{ALL_AXES, AxisSet, CONFIRMATION, Command, Instruction, MotorField, Opcode, Status};

/// Admits a command of a host. Checked in this order are the number, whether the command may be executed outside a
/// program, the motor field, and, when it is carried out, what the command itself demands.
#[inline(always)]
pub(crate) fn admit<P: Product, const AXES: usize>(command: Command) -> Result<Opcode, Status> {
    let instruction = Instruction::numbered(command.opcode).ok_or(Status::InvalidCommand)?;
    if !instruction.direct {
        return Err(Status::NotAvailable);
    }
    check_motor::<P, AXES>(instruction, command.motor).map(|()| instruction.opcode)
}

/// Whether the product has the command, and the motor that its motor field names. Inlined, because every reply waits
/// for it: a call takes 27 cycles.
#[inline(always)]
pub(crate) fn check_motor<P: Product, const AXES: usize>(instruction: &Instruction, motor: u8) -> Result<(), Status> {
    let known = usize::from(motor) < AXES;
    if P::SPEC.lacks.contains(&instruction.opcode) {
        return Err(Status::InvalidCommand);
    }
    match instruction.motor {
        MotorField::Axis if !known => Err(Status::InvalidValue),
        MotorField::AxisOrAll if !known && motor != ALL_AXES => Err(Status::InvalidValue),
        MotorField::AxisSet if !known && AxisSet::of(motor, AXES as u8).is_none() => Err(Status::InvalidValue),
        MotorField::Axis | MotorField::AxisOrAll | MotorField::AxisSet | MotorField::Other => Ok(()),
    }
}

/// Checks the value 1234, which protects commands 137 and 255.
pub(crate) fn confirm(value: i32) -> Result<(), Status> {
    if value == CONFIRMATION { Ok(()) } else { Err(Status::InvalidValue) }
}
