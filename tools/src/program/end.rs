//! Where a program in program memory ends.

use tmcm::tmcl::{Command, Opcode};

use super::target;

/// True if the next command is executed after this one, or may be.
pub fn goes_on(command: &Command) -> bool {
    let ends =
        matches!(Opcode::from_number(command.opcode), Some(Opcode::Stop | Opcode::Ja | Opcode::Rsub | Opcode::Reti));
    // A module takes command 0 for the end.
    !ends && command.opcode != 0
}

/// The number of commands of the program that begins with the first one, which has the address `origin`. The program
/// goes up to a command after which it does not go on, if no jump, call or vector leads behind it. A STOP that the
/// assembler has put at the end belongs to it, though nothing may lead there.
pub fn end(commands: &[Command], origin: usize) -> usize {
    let mut furthest = 0;
    for (index, command) in commands.iter().enumerate() {
        let target = target(command).and_then(|target| usize::try_from(target).ok()?.checked_sub(origin));
        furthest = target.filter(|target| *target < commands.len()).unwrap_or_default().max(furthest);
        if !goes_on(command) && furthest <= index {
            let rest = commands.get(index + 1..).unwrap_or_default();
            let is_nothing = rest.iter().all(|command| command.opcode == 0 || command.opcode == Opcode::Stop as u8);
            return if is_nothing { commands.len() } else { index + 1 };
        }
    }
    commands.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asm::{Settings, assemble_text};

    fn end_of(source: &str, origin: u16) -> (usize, usize) {
        let settings = Settings { origin, ..Settings::default() };
        let commands = assemble_text("test.tmc", source, settings).unwrap().commands;
        (end(&commands, origin.into()), commands.len())
    }

    #[test]
    fn a_program_ends_where_nothing_leads_behind() {
        for origin in [0, 50] {
            assert_eq!(end_of("Loop: MST 0\nJA Loop\nMST 0\n", origin), (2, 4));
            assert_eq!(end_of("CSUB Sub\nSTOP\nSub: MST 0\nRSUB\nMST 0\n", origin), (4, 6));
            assert_eq!(end_of("VECT 0, Tick\nLoop: JA Loop\nTick: RETI\nNOP\nMST 0\n", origin), (3, 6));
            assert_eq!(end_of("JC ZE, End\nSTOP\nMST 0\nEnd: MST 0\nNOP\nMST 0\n", origin), (5, 7));
            assert_eq!(end_of("JA Two\nJA Three\nTwo: STOP\nThree: STOP\n", origin), (4, 4));
            assert_eq!(end_of("Loop: JA Loop\nSTOP\nNOP\n", origin), (4, 4));
            assert_eq!(end_of("#nostop\nMST 0\nMST 0\n", origin), (2, 2));
            assert_eq!(end_of("#nostop\nJA 2000\nMST 0\n", origin), (1, 2));
        }
        assert_eq!(end(&[], 0), 0);
    }
}
