//! The program in a module, read back and as source.

use std::ops::Range;

use tmcm::tmcl::{Command, Status};

use crate::conversation::{Conversation, Identity};
use crate::failure::Failure;
use crate::product::short;
use crate::program::{end, goes_on};
use crate::progress::Progress;
use crate::stop::Stop;

/// Reads the commands at some addresses, or up to the end of program memory, where a module refuses to go on.
///
/// # Errors
/// The link fails, or it is to end.
pub fn read(
    module: &mut Conversation,
    addresses: Range<usize>,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Vec<Command>, Failure> {
    let total = addresses.len();
    let mut reach = |done| progress(Progress { what: "reading the program", done, total });
    reach(0);
    let mut commands = Vec::new();
    for address in addresses {
        if stop.happened() {
            return Err(stop.interrupted("interrupted; nothing has been written"));
        }
        let Ok(address) = u16::try_from(address) else { break };
        match module.memory(address) {
            Ok(command) => commands.push(command),
            Err(error) if error.is(Status::InvalidValue) && !commands.is_empty() => break,
            Err(error) => return Err(error.into()),
        }
        reach(commands.len());
    }
    Ok(commands)
}

/// Takes the empty commands at the end away, but for one that ends the program.
pub fn trim(commands: &mut Vec<Command>) {
    let is_empty = |command: &Command| *command == Command::default();
    let used = commands.iter().rposition(|command| !is_empty(command)).map_or(0, |last| last + 1);
    let ends = commands.get(..used).and_then(<[Command]>::last).is_none_or(|last| !goes_on(last));
    commands.truncate(if ends { used } else { used + 1 });
}

/// The heading of the source: what it is and how it becomes a program again.
pub fn heading(commands: &[Command], at: u16, identity: Identity) -> String {
    let number = identity.number;
    let version = identity.version.map_or_else(String::new, |_| format!(" ({identity})"));
    let mut call = "tmcl asm".to_string();
    if let Some(product) = identity.product {
        call += &format!(" --product {}", short(product));
    }
    if at > 0 {
        call += &format!(" --origin {at}");
    }
    format!(
        "// TMCM-{number}{version}: {}\n// Assembled by {call} it has the same commands again.\n",
        summary(commands, at)
    )
}

/// How many commands there are and where.
pub fn summary(commands: &[Command], at: u16) -> String {
    let Some(last) = commands.len().checked_sub(1) else { return "program memory is empty".into() };
    let at = usize::from(at);
    let plural = if last == 0 { "" } else { "s" };
    let mut text = format!("{} command{plural}, addresses {at} to {}", commands.len(), at + last);
    let end = end(commands, at);
    if end < commands.len() {
        text += &format!("; the program that begins at {at} ends at {}", at + end - 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_empty_at_the_end_is_left_out_unless_it_ends_the_program() {
        let trimmed = |text: &str| {
            let mut commands: Vec<Command> = text.lines().map(|line| tmcm::tmcl::text::parse(line).unwrap()).collect();
            trim(&mut commands);
            commands.len()
        };
        assert_eq!(trimmed("MST 0\nSTOP\n0, 0, 0, 0\n0, 0, 0, 0"), 2);
        assert_eq!(trimmed("MST 0\n0, 0, 0, 0\n0, 0, 0, 0"), 2);
        assert_eq!(trimmed("0, 0, 0, 0\nMST 0\n0, 0, 0, 0\nJA 1\n0, 0, 0, 0"), 4);
        assert_eq!(trimmed("MST 0\nMST 0"), 2);
        assert_eq!((trimmed("0, 0, 0, 0\n0, 0, 0, 0"), trimmed("")), (0, 0));
    }
}
