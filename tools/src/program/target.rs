//! The target addresses of jumps, calls and vectors.

use tmcm::tmcl::{Command, Opcode};

/// The address at which a jump, call or vector makes the program go on; `None` for other commands.
pub fn target(command: &Command) -> Option<i32> {
    match Opcode::from_number(command.opcode)? {
        Opcode::Ja | Opcode::Jc | Opcode::Csub | Opcode::Vect => Some(command.value),
        _ => None,
    }
}
