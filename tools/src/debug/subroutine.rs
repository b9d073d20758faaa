//! How deep a program is in subroutines, by what each of its steps has done.

use tmcm::tmcl::Opcode;

use crate::program::{Program, target};

/// The number of subroutines that a program is in behind a step from one address to another, if it was in `depth` of
/// them before. A step that goes to the handler of an interrupt executes no command. So a CSUB counts if it has led to
/// its target, and a RSUB if it has led behind a CSUB.
pub(super) fn depth_behind(depth: u32, program: &Program, from: u16, to: u16) -> u32 {
    let command = |address: u16| program.commands.get(usize::from(address));
    let opcode = |address| command(address).and_then(|command| Opcode::from_number(command.opcode));
    match opcode(from) {
        Some(Opcode::Csub) if command(from).and_then(target) == Some(to.into()) => depth.saturating_add(1),
        Some(Opcode::Rsub) if to.checked_sub(1).and_then(opcode) == Some(Opcode::Csub) => depth.saturating_sub(1),
        _ => depth,
    }
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::text;

    use super::*;

    #[test]
    fn calls_and_returns_are_told_from_interrupts() {
        let lines = ["CSUB 3", "JA 0", "STOP", "CSUB 3", "RSUB", "RETI"];
        let program = Program::from(lines.map(|line| text::parse(line).unwrap()).to_vec());
        for (depth, from, to, expected) in
            [(0, 0, 3, 1), (1, 3, 3, 2), (2, 4, 4, 1), (1, 4, 1, 0), (0, 1, 0, 0), (0, 0, 5, 0), (1, 4, 5, 1)]
        {
            assert_eq!(depth_behind(depth, &program, from, to), expected, "{from} to {to}");
        }
    }
}
