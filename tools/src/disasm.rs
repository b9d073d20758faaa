//! The source of an assembled program.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use tmcm::tmcl::{Command, Instruction, Opcode};

use crate::product::{Product, parameter};
use crate::program::{end, target};

/// Column of the comments.
const COMMENT: usize = 36;

/// A source that assembles to these commands when the first one has the address `origin`. It has the names that
/// parameters have on a product, and no names for a product that is not known. Where the program ends and more follows,
/// a comment says so.
pub fn source(commands: &[Command], origin: u16, product: Option<Product>) -> String {
    let origin = usize::from(origin);
    let addresses = origin..origin + commands.len();
    let inside = |target: i32| usize::try_from(target).ok().filter(|target| addresses.contains(target));
    let label = |command: &Command| target(command).and_then(inside);
    let labels: BTreeSet<usize> = commands.iter().filter_map(label).collect();
    let mut text = String::new();
    // Writing to a string cannot fail.
    if commands.last() != Some(&Command { opcode: Opcode::Stop as u8, ..Command::default() }) {
        let _ = writeln!(text, "#nostop");
    }
    let end = end(commands, origin);
    for (address, command) in addresses.clone().zip(commands) {
        if address == origin + end {
            let _ = writeln!(text, "    // Nothing above leads to what follows.");
        }
        if labels.contains(&address) {
            let _ = writeln!(text, "L{address}:");
        }
        let plain = command.to_string();
        // In the mnemonic and in the numeric form of a command the target is the last operand.
        let line = match label(command).zip(plain.rsplit_once(' ')) {
            Some((target, (front, _))) => format!("    {front} L{target}"),
            None => format!("    {plain}"),
        };
        let _ = match comment(command, &plain, product) {
            Some(comment) => writeln!(text, "{line:COMMENT$}// {comment}"),
            None => writeln!(text, "{line}"),
        };
    }
    text
}

/// The comment behind a command: the name of its parameter, and its mnemonic if the command is written as numbers.
fn comment(command: &Command, plain: &str, product: Option<Product>) -> Option<String> {
    let opcode = Opcode::from_number(command.opcode)?;
    let Instruction { mnemonic, .. } = opcode.instruction();
    let name = product.and_then(|product| parameter(product.spec(), opcode, *command)).map(|parameter| parameter.name);
    match (mnemonic.is_empty() || plain.starts_with(mnemonic), name) {
        (true, name) => name,
        (false, Some(name)) => Some(format!("{mnemonic}, {name}")),
        (false, None) => Some((*mnemonic).to_string()),
    }
}
