//! Where the commands of a program lead.

use tmcm::tmcl::{Command, Opcode};

/// Where a command makes the program go on, now or at an interrupt.
pub fn target(command: &Command) -> Option<i32> {
    match Opcode::from_number(command.opcode)? {
        Opcode::Ja | Opcode::Jc | Opcode::Csub | Opcode::Vect => Some(command.value),
        _ => None,
    }
}
