//! TMCL programs with what is known of their source, their files, and their download into a module.

mod address;
pub mod binary;
mod download;
mod end;
mod target;
mod there;
mod transfer;

pub use address::address;
pub use download::{download, explain, is_readable, verify};
pub use end::{end, goes_on};
pub use target::target;
pub use there::{There, there};
pub use transfer::{Done, Transfer, fits, transfer};

use serde::Serialize;
use tmcm::tmcl::Command;

use crate::asm::{Assembly, Symbols};
use crate::shown::shown;

/// A program as a module stores it, with what is known of its source.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Program {
    /// The commands; the first has address 0 unless the program is loaded to another address.
    pub commands: Vec<Command>,
    /// Labels with their addresses; empty for an assembled file.
    pub labels: Vec<(String, u16)>,
    /// Labels and constants of the source; none for an assembled file.
    pub symbols: Symbols,
    /// For each address the line of the source; `None` for a command that the assembler has added. Empty for an
    /// assembled file.
    lines: Vec<Option<Line>>,
}

/// A line of the source.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Line {
    /// Number of the line, after the name of the file if the file was included by another one.
    pub position: String,
    /// Text of the line.
    pub text: String,
}

impl Line {
    /// The name of the file if it was included by another one, and the number of the line.
    pub fn place(&self) -> (Option<&str>, usize) {
        let (file, number) = match self.position.rsplit_once(':') {
            Some((file, number)) => (Some(file), number),
            None => (None, self.position.as_str()),
        };
        (file, number.parse().unwrap_or_default())
    }
}

impl Program {
    /// The address of a label. Upper and lower case are the same.
    pub fn address(&self, label: &str) -> Option<u16> {
        self.labels.iter().find(|(name, _)| name.eq_ignore_ascii_case(label)).map(|(_, address)| *address)
    }

    /// True for a program that was assembled from a source.
    pub fn has_source(&self) -> bool {
        !self.lines.is_empty()
    }

    /// True if nobody has written any command: a STOP that the assembler has added is none.
    pub fn is_empty(&self) -> bool {
        self.commands.is_empty() || self.has_source() && self.lines.iter().all(Option::is_none)
    }

    /// The source line of the command at an address.
    pub fn line(&self, address: u16) -> Option<&Line> {
        self.lines.get(usize::from(address))?.as_ref()
    }

    /// The label at an address, if there is one.
    pub fn label(&self, address: u16) -> Option<&str> {
        self.labels.iter().find(|(_, start)| *start == address).map(|(name, _)| name.as_str())
    }

    /// An address in words, with the label at this address or the nearest one before it.
    pub fn location(&self, address: u16) -> String {
        let above = self.labels.iter().filter(|(_, start)| *start <= address).max_by_key(|(_, start)| *start);
        match above {
            None => format!("address {address}"),
            Some((name, start)) if *start == address => format!("address {address} ({name})"),
            Some((name, start)) => format!("address {address} ({name} + {})", address - start),
        }
    }

    /// A command as text; a target address that has a label is written as the label.
    pub fn text(&self, command: &Command) -> String {
        let plain = command.to_string();
        let target = target(command).and_then(|target| u16::try_from(target).ok());
        // The target is the last operand.
        match target.and_then(|target| self.label(target)).zip(plain.rsplit_once(' ')) {
            Some((label, (front, _))) => format!("{front} {label}"),
            None => plain,
        }
    }

    /// The commands with their addresses when the first one has the address `at`. Commands beyond address 65 535 are
    /// left out.
    pub fn at_addresses(&self, at: u16) -> impl Iterator<Item = (u16, Command)> {
        (at..=u16::MAX).zip(self.commands.iter().copied())
    }
}

impl From<Vec<Command>> for Program {
    fn from(commands: Vec<Command>) -> Self {
        Program { commands, ..Program::default() }
    }
}

impl From<Assembly> for Program {
    fn from(assembly: Assembly) -> Self {
        let main = assembly.lines.first().map(|line| &line.source.name);
        let line = |address| {
            let line = assembly.line(address)?;
            let position = if Some(&line.source.name) == main {
                line.number.to_string()
            } else {
                format!("{}:{}", line.source.name, line.number)
            };
            Some(Line { position, text: shown(line.text().trim()).replace('\t', " ") })
        };
        let lines = (0..assembly.addresses().end).map(line).collect();
        let labels = assembly.symbols.labels();
        let labels = labels.filter_map(|(name, address)| Some((name.into(), u16::try_from(address).ok()?))).collect();
        Program { commands: assembly.commands, labels, symbols: assembly.symbols, lines }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asm::assemble_text;
    use crate::product::Product;

    #[test]
    fn commands_have_addresses() {
        let program = Program::from(vec![Command::new(4, 0, 0, 90_000), Command::new(28, 0, 0, 0)]);
        let placed: Vec<u16> = program.at_addresses(50).map(|(address, _)| address).collect();
        assert_eq!(placed, [50, 51]);
        assert_eq!(program.line(0), None);
    }

    #[test]
    fn a_source_gives_labels_and_lines() {
        let source = "#include Interrupts.inc\n\nStart: EI TI_GLOBAL // go\nLoop:\n\tJA Loop\nEnd:\n";
        let program = Program::from(assemble_text("test.tmc", source, Some(Product::Tmcm1140)).unwrap());
        assert_eq!((program.address("LOOP"), program.address("end"), program.address("x")), (Some(1), Some(2), None));
        let line = |position: &str, text: &str| Some(Line { position: position.into(), text: text.into() });
        let told = [0, 1, 2].map(|address| program.line(address).cloned());
        assert_eq!(told, [line("3", "Start: EI TI_GLOBAL // go"), line("5", "JA Loop"), None]);
        assert_eq!(
            [0, 1, 3].map(|at| program.location(at)),
            ["address 0 (Start)", "address 1 (Loop)", "address 3 (End + 1)"]
        );
        assert_eq!(program.text(&Command::new(21, 1, 0, 1)), "JC NZ, Loop");
        assert_eq!(program.text(&Command::new(4, 0, 0, 1)), "MVP ABS, 0, 1");
    }
}
