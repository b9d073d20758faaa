//! TMCL programs: reading them from a file, and their way into a module.

mod download;

pub use download::{download, is_readable, verify};

use std::path::Path;

use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Command, Opcode};

use crate::failure::Failure;

/// Length of a command in a binary file: seven bytes and their sum.
const RECORD: usize = TELEGRAM - 1;
/// Command numbers from here on control the module even in download mode; a program cannot have them.
const FIRST_CONTROL: u8 = Opcode::StopApplication as u8;

/// A program as a module stores it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Program {
    /// Its commands; the first is at address 0 unless it is loaded elsewhere.
    pub commands: Vec<Command>,
    /// Names of addresses. A binary file has none.
    pub labels: Vec<(String, u16)>,
}

impl Program {
    /// The address of a label, in any case.
    pub fn address(&self, label: &str) -> Option<u16> {
        self.labels.iter().find(|(name, _)| name.eq_ignore_ascii_case(label)).map(|(_, address)| *address)
    }

    /// The commands with their addresses, if the first is at `at`. Those beyond the address range are left out.
    pub fn placed(&self, at: u16) -> impl Iterator<Item = (u16, Command)> {
        (at..=u16::MAX).zip(self.commands.iter().copied())
    }

    /// Reads the binary form: eight bytes a command, the last of which is the sum of the others.
    fn from_binary(bytes: &[u8]) -> Result<Self, String> {
        let (records, rest) = bytes.as_chunks::<RECORD>();
        if records.is_empty() || !rest.is_empty() {
            let length = bytes.len();
            return Err(format!("{length} bytes are no program; a binary program has {RECORD} bytes for each command"));
        }
        let commands =
            (0..).zip(records).map(|(number, record)| command(record).map_err(|e| format!("command {number}: {e}")));
        Ok(Program { commands: commands.collect::<Result<_, String>>()?, labels: Vec::new() })
    }
}

/// Reads one command of a binary file.
fn command(record: &[u8; RECORD]) -> Result<Command, String> {
    // A telegram without the address in front of it; its sum is the same with an address of zero.
    let mut telegram = [0; TELEGRAM];
    telegram[1..].copy_from_slice(record);
    let command = binary::decode_command(&telegram).ok_or("wrong checksum; the file is damaged or not a program")?;
    if command.opcode >= FIRST_CONTROL {
        return Err(format!("number {} cannot stand in a program", command.opcode));
    }
    Ok(command)
}

/// Reads the program in a file.
pub fn read_program(path: &Path) -> Result<Program, Failure> {
    let shown = path.display();
    let bytes = std::fs::read(path).map_err(|error| Failure::Failed(format!("cannot read {shown}: {error}")))?;
    Program::from_binary(&bytes).map_err(|error| Failure::Failed(format!("{shown}: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// MVP ABS, 0, 90000 and STOP.
    const BINARY: [u8; 16] = [4, 0, 0, 0, 1, 0x5F, 0x90, 0xF4, 28, 0, 0, 0, 0, 0, 0, 28];

    #[test]
    fn a_binary_file_is_read() {
        let program = Program::from_binary(&BINARY).unwrap();
        assert_eq!(program.commands, [Command::new(4, 0, 0, 90_000), Command::new(28, 0, 0, 0)]);
        let placed: Vec<u16> = program.placed(50).map(|(address, _)| address).collect();
        assert_eq!(placed, [50, 51]);
    }

    #[test]
    fn damaged_files_are_told() {
        let text = |bytes: &[u8]| Program::from_binary(bytes).unwrap_err();
        assert!(text(&[]).contains("0 bytes"));
        assert!(text(&BINARY[..15]).contains("15 bytes"));
        let mut damaged = BINARY;
        damaged[9] = 1;
        assert!(text(&damaged).starts_with("command 1: wrong checksum"));
        assert!(text(&[129, 0, 0, 0, 0, 0, 0, 129]).contains("number 129 cannot stand in a program"));
    }

    #[test]
    fn labels_have_addresses() {
        let program = Program { commands: Vec::new(), labels: vec![("Loop".into(), 3)] };
        assert_eq!((program.address("LOOP"), program.address("Start")), (Some(3), None));
    }
}
