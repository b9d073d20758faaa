//! `tmcl load`: a program into a module.

use std::io::Write;

use clap::Args;
use tmcm::param::GlobalParameter;
use tmcm::tmcl::{Command, Opcode};

use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::product::global_number;
use crate::program::{Program, ProgramThere, download, read_program, target, verify};
use crate::signal::EndSignal;

/// Load a TMCL program into a module, where it stays
///
/// FILE is a source, which is assembled first, or an assembled program: what `tmcl asm` makes, or the vendor's
/// assembler. A program that runs in the module is stopped first; a motor that it has set in motion goes on turning.
/// Nothing starts unless --run is given.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module and its program
    #[command(flatten)]
    pub program: ProgramThere,

    /// Read the program back and compare
    #[arg(long)]
    pub verify: bool,

    /// Start it, at the address it is loaded to
    #[arg(long)]
    pub run: bool,

    /// Let the module start the program at address 0 by itself after power-up (global parameter 77)
    #[arg(long)]
    pub autostart: bool,

    /// Address in program memory of the first command; the rest of the memory stays as it is
    ///
    /// Labels count from 0, wherever a program is loaded to: with --at 50, write JA Loop + 50.
    #[arg(long, value_name = "ADDRESS", default_value_t = 0)]
    pub at: u16,
}

const EXAMPLES: &str = "\
Examples:
  tmcl load /dev/ttyACM0 stage.tmc --verify --run   load it, compare it, start it
  tmcl load /dev/ttyACM0 stage.tmc --autostart      to be run from the next power-up on
  tmcl load /dev/ttyACM0 routine.tmc --at 50        beside the program that is there
  tmcl send /dev/ttyACM0 \"129, 1, 0, 50\"          runs such a routine";

/// Type of command 129 that starts the program at an address.
const FROM_ADDRESS: u8 = 1;

/// Loads a program; compares, stores the autostart and starts the program if the options say so.
pub fn run(options: &Options) -> Result<(), Failure> {
    let at = options.at;
    let signal = EndSignal::watch()?;
    let mut module = Conversation::open(&options.program.reach)?;
    let product = module.product()?;
    let program = read_program(&options.program.file, product)?;
    let count = program.commands.len();
    let end = usize::from(at) + count;
    if let Some(room) = product.map(|product| product.spec().commands)
        && end > room.into()
    {
        let memory = room - 1;
        let message = format!("{count} commands from address {at} on do not fit; program memory ends at {memory}");
        return Err(Failure::Failed(message));
    }
    if let Some(warning) = jump_outside(&program, at) {
        writeln!(std::io::stderr(), "tmcl: warning: {warning}")?;
    }
    download(&mut module, &program, at, &signal)?;
    let mut out = std::io::stdout().lock();
    writeln!(out, "loaded to addresses {at} to {}", end - 1)?;
    if options.verify {
        verify(&mut module, &program, at, &signal)?;
        writeln!(out, "the module has them as they are in the file")?;
    }
    if options.autostart {
        if let Some(number) = global_number(product, GlobalParameter::AutoStart) {
            module.value(Command::new(Opcode::Sgp as u8, number, 0, 1))?;
        }
        writeln!(out, "the program starts by itself after power-up")?;
    }
    if options.run {
        module.control(Opcode::RunApplication, FROM_ADDRESS, at.into())?;
        writeln!(out, "running from address {at}")?;
    }
    Ok(())
}

/// A warning if a program loaded to address `at` has a jump to an address below: its labels probably count from 0.
fn jump_outside(program: &Program, at: u16) -> Option<String> {
    let inside = |target: i32| (0..i32::from(at)).contains(&target);
    let (address, command) = program.at_addresses(at).find(|(_, command)| target(command).is_some_and(inside))?;
    Some(format!("address {address}: {command} leads out of this program; labels count from 0, so write Label + {at}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_to_an_address_below_the_program_is_warned_of() {
        let told = |line: &str, at| {
            let command = tmcm::tmcl::text::parse(line).unwrap();
            jump_outside(&vec![Command::new(1, 0, 0, 0), command].into(), at)
        };
        assert_eq!(told("JA 0", 0), None);
        assert_eq!(told("JA 50", 50), None);
        assert!(told("JC ZE, 1", 50).unwrap().starts_with("address 51: JC ZE, 1 leads out"));
    }
}
