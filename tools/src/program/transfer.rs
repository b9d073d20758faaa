//! A program on its way into the module, and what is done with it there.

use std::fmt;

use tmcm::param::GlobalParameter;
use tmcm::tmcl::{Command, Opcode};

use super::{Program, download, explain, target, verify};
use crate::asm::Settings;
use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::product::global_number;
use crate::progress::Progress;
use crate::stop::Stop;

/// Type of command 129 that starts the program at an address.
const FROM_ADDRESS: u8 = 1;

/// The tasks with a program besides loading it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Transfer {
    /// Address in program memory of the first command; the rest of the memory stays as it is.
    pub at: u16,
    /// Read it back and compare.
    pub verify: bool,
    /// Let the module start the program at address 0 by itself after power-up (global parameter 77).
    pub autostart: bool,
    /// Start it, at the address it is loaded to.
    pub run: bool,
}

/// A step that has been done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// The program is in the module, at these addresses.
    Loaded {
        /// The address of the first command.
        first: u16,
        /// The address of the last one.
        last: usize,
    },
    /// The program has been read back, and is the same.
    Verified,
    /// The program starts after power-up.
    Autostart,
    /// The program runs, from this address on.
    Running(u16),
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Done::Loaded { first, last } => write!(f, "loaded to addresses {first} to {last}"),
            Done::Verified => f.write_str("the module has them as they are in the file"),
            Done::Autostart => f.write_str("the program starts by itself after power-up"),
            Done::Running(at) => write!(f, "running from address {at}"),
        }
    }
}

/// Whether a program has room from its origin on. What may be wrong with it all the same is a warning.
///
/// # Errors
/// It does not fit into program memory.
pub fn fits(program: &Program, Settings { product, origin, .. }: Settings) -> Result<Option<String>, Failure> {
    let count = program.commands.len();
    if let Some(room) = product.map(|product| product.spec().commands)
        && usize::from(origin) + count > room.into()
    {
        let memory = room - 1;
        let message = format!("{count} commands from address {origin} on do not fit; program memory ends at {memory}");
        return Err(Failure::Failed(message));
    }
    Ok(jump_outside(program, origin))
}

/// Puts a program into the module, and does what is wanted then. `tell` hears of each thing that is done.
///
/// # Errors
/// The module refuses a command or has another program than was sent, the link fails, it has been asked to end, or
/// `tell` fails.
pub fn transfer<E: From<Failure>>(
    module: &mut Conversation,
    program: &Program,
    wanted: Transfer,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
    mut tell: impl FnMut(Done) -> Result<(), E>,
) -> Result<(), E> {
    let Transfer { at, .. } = wanted;
    download(module, program, at, stop, progress)?;
    tell(Done::Loaded { first: at, last: (usize::from(at) + program.commands.len()).saturating_sub(1) })?;
    if wanted.verify {
        verify(module, program, at, stop, progress)?;
        tell(Done::Verified)?;
    }
    if wanted.autostart {
        if let Some(number) = global_number(module.product().map_err(Failure::from)?, GlobalParameter::AutoStart) {
            let autostart = Command::new(Opcode::Sgp as u8, number, 0, 1);
            module.value(autostart).map_err(|error| explain(module, error))?;
        }
        tell(Done::Autostart)?;
    }
    if wanted.run {
        module.control(Opcode::RunApplication, FROM_ADDRESS, at.into()).map_err(Failure::from)?;
        tell(Done::Running(at))?;
    }
    Ok(())
}

/// A warning if an assembled program loaded to address `at` has a jump to an address below: it was probably assembled
/// for address 0. Of jumps in a source the assembler has warned already.
fn jump_outside(program: &Program, at: u16) -> Option<String> {
    if program.has_source() {
        return None;
    }
    let inside = |target: i32| (0..i32::from(at)).contains(&target);
    let (address, command) = program.at_addresses(at).find(|(_, command)| target(command).is_some_and(inside))?;
    Some(format!(
        "address {address}: {command} leads out of this program; load its source, or assemble it with tmcl asm --origin {at}"
    ))
}

#[cfg(test)]
mod tests {
    use crate::asm::assemble_text;

    use super::*;

    #[test]
    fn a_jump_to_an_address_below_an_assembled_program_is_warned_of() {
        let told = |line: &str, at| {
            let command = tmcm::tmcl::text::parse(line).unwrap();
            jump_outside(&vec![Command::new(1, 0, 0, 0), command].into(), at)
        };
        assert_eq!(told("JA 0", 0), None);
        assert_eq!(told("JA 50", 50), None);
        assert!(told("JC ZE, 1", 50).unwrap().starts_with("address 51: JC ZE, 1 leads out"));
        let source = assemble_text("test.tmc", "JA 0", Settings::default()).unwrap();
        assert_eq!(jump_outside(&source.into(), 50), None, "the assembler has told of it");
    }
}
