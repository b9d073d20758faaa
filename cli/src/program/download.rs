//! Writing a program to a module's program memory, and reading it back for comparison (manual section 3.7.38).

use tmcm::param::{AGAINST_READING, GlobalParameter};
use tmcm::tmcl::{Command, Opcode, Status};

use super::Program;
use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::global_number;
use crate::progress::Progress;
use crate::signal::EndSignal;

/// Stops the program in the module and writes the new one from address `at` on. The module's program counter is 0 then.
///
/// After a failure a STOP is written at `at`, so that an incomplete program does not run.
///
/// # Errors
/// The module refuses a command, the link fails, or a signal has come.
pub fn download(module: &mut Conversation, program: &Program, at: u16, signal: &EndSignal) -> Result<(), Failure> {
    module.control(Opcode::ResetApplication, 0, 0)?;
    module.control(Opcode::EnterDownload, 0, at.into()).map_err(explain)?;
    if let Err(failure) = send(module, program, at, signal) {
        // These commands may fail, too; only the first failure is reported.
        let _ = module.control(Opcode::EnterDownload, 0, at.into());
        let _ = module.value(Command::new(Opcode::Stop as u8, 0, 0, 0));
        let _ = module.control(Opcode::ExitDownload, 0, 0);
        return Err(failure);
    }
    module.control(Opcode::ExitDownload, 0, 0).map_err(explain)?;
    Ok(())
}

/// Sends the commands of a program, each of which the module must store and not execute.
fn send(module: &mut Conversation, program: &Program, at: u16, signal: &EndSignal) -> Result<(), Failure> {
    let total = program.commands.len();
    let mut progress = Progress::new("loading the program", total);
    for (done, (address, command)) in (1..).zip(program.at_addresses(at)) {
        if signal.happened() {
            return Err(signal.failure("interrupted; the module has no program now"));
        }
        let reply = module.request(command).map_err(|error| {
            let size = error.is(Status::InvalidValue);
            let hint = if size { "; the program does not fit into program memory" } else { "" };
            Failure::Failed(format!("address {address}: {}{hint}", explain(error)))
        })?;
        if reply.status() != Some(Status::Loaded) {
            let message = "the module has not stored the command, it may have executed it: has it been restarted?";
            return Err(Failure::Failed(format!("address {address}: {command}: {message}")));
        }
        progress.reach(done);
    }
    Ok(())
}

/// The failure of a refused download, with a hint if program memory is protected.
fn explain(error: Error) -> Failure {
    if error.is(Status::EepromLocked) {
        let lift = "\"SGP 81, 0, 0\" lifts the protection; it erases a program that is protected from being read, too";
        return Failure::Failed(format!("program memory is protected (global parameter 81): {lift}"));
    }
    error.into()
}

/// False if the module's code protection keeps the program from being read.
pub fn is_readable(module: &mut Conversation) -> Result<bool, Error> {
    let Some(protection) = global_number(module.product()?, GlobalParameter::CodeProtection) else { return Ok(true) };
    Ok(module.value(Command::new(Opcode::Ggp as u8, protection, 0, 0))? & AGAINST_READING == 0)
}

/// Compares the commands in the module, from address `at` on, with a program.
///
/// # Errors
/// A command differs, the program is protected from being read, the link fails, or a signal has come.
pub fn verify(module: &mut Conversation, program: &Program, at: u16, signal: &EndSignal) -> Result<(), Failure> {
    if !is_readable(module)? {
        let message = "the program cannot be compared: it is protected from being read (global parameter 81)";
        return Err(Failure::Failed(message.into()));
    }
    let total = program.commands.len();
    let mut progress = Progress::new("comparing the program", total);
    let mut differences = Vec::new();
    for (done, (address, expected)) in (1..).zip(program.at_addresses(at)) {
        if signal.happened() {
            return Err(signal.failure("interrupted; the program is loaded but not compared"));
        }
        let found = module.memory(address)?;
        if found != expected {
            differences.push(format!("address {address}: expected {expected}, found {found}"));
        }
        progress.reach(done);
    }
    match differences.first() {
        None => Ok(()),
        Some(first) => {
            let count = differences.len();
            Err(Failure::Failed(format!("{count} of {total} commands differ; {first}")))
        }
    }
}
