//! A program on its way into the module, and what is done with it there.

use std::io::Write;

use tmcl_link::EndSignal;
use tmcl_tools::asm::Settings;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::product::global_number;
use tmcl_tools::program::{Program, download, explain, target, verify};
use tmcm::param::GlobalParameter;
use tmcm::tmcl::{Command, Opcode};

use super::options::Options;
use crate::failure::Failure;
use crate::progress;
use crate::tell;

/// Type of command 129 that starts the program at an address.
const FROM_ADDRESS: u8 = 1;

/// A program that has room from its origin on, with warnings about it printed.
pub(super) fn fit(program: Program, Settings { product, origin, .. }: Settings) -> Result<Program, Failure> {
    let count = program.commands.len();
    if let Some(room) = product.map(|product| product.spec().commands)
        && usize::from(origin) + count > room.into()
    {
        let memory = room - 1;
        let message = format!("{count} commands from address {origin} on do not fit; program memory ends at {memory}");
        return Err(Failure::Failed(message));
    }
    if let Some(warning) = jump_outside(&program, origin) {
        // A closed standard error does not end the program.
        let _ = tell::warning(warning);
    }
    Ok(program)
}

/// Puts a program into the module, and does what the options say then.
pub(super) fn load(
    module: &mut Conversation,
    program: &Program,
    options: &Options,
    signal: &EndSignal,
) -> Result<(), Failure> {
    let at = options.at;
    download(module, program, at, signal, &mut progress::bar())?;
    let mut out = tell::out();
    writeln!(out, "loaded to addresses {at} to {}", usize::from(at) + program.commands.len() - 1)?;
    if options.verify {
        verify(module, program, at, signal, &mut progress::bar())?;
        writeln!(out, "the module has them as they are in the file")?;
    }
    if options.autostart {
        if let Some(number) = global_number(module.product()?, GlobalParameter::AutoStart) {
            let autostart = Command::new(Opcode::Sgp as u8, number, 0, 1);
            module.value(autostart).map_err(|error| explain(module, error))?;
        }
        writeln!(out, "the program starts by itself after power-up")?;
    }
    if options.run {
        module.control(Opcode::RunApplication, FROM_ADDRESS, at.into())?;
        writeln!(out, "running from address {at}")?;
    }
    Ok(())
}

/// A warning if an assembled program loaded to address `at` has a jump to an address below: it was probably assembled for
/// address 0. Of jumps in a source the assembler has warned already.
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
    use tmcl_tools::asm::assemble_text;

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
