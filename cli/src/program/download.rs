//! A program into a module's program memory, and back to be compared (manual section 3.7.38).

use tmcm::param::{AGAINST_READING, GlobalParameter};
use tmcm::tmcl::{Command, Opcode, Status};

use super::Program;
use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::global_number;
use crate::progress::Progress;
use crate::signal::EndSignal;

/// Stops the program in the module and replaces it, from address `at` on. The module's next program counter is 0.
///
/// A download that fails in the middle leaves a STOP at `at`, so that the half that is there does not run.
pub fn download(module: &mut Conversation, program: &Program, at: u16, signal: &EndSignal) -> Result<(), Failure> {
    module.control(Opcode::ResetApplication, 0, 0)?;
    module.control(Opcode::EnterDownload, 0, at.into()).map_err(explain)?;
    if let Err(failure) = send(module, program, at, signal) {
        // What has gone wrong may go wrong again; it is the first failure that counts.
        let _ = module.control(Opcode::EnterDownload, 0, at.into());
        let _ = module.value(Command::new(Opcode::Stop as u8, 0, 0, 0));
        let _ = module.control(Opcode::ExitDownload, 0, 0);
        return Err(failure);
    }
    module.control(Opcode::ExitDownload, 0, 0).map_err(explain)?;
    Ok(())
}

/// Sends the commands, each of which has to be stored and not executed.
fn send(module: &mut Conversation, program: &Program, at: u16, signal: &EndSignal) -> Result<(), Failure> {
    let total = program.commands.len();
    let mut progress = Progress::new("loading the program", total);
    for (done, (address, command)) in (1..).zip(program.placed(at)) {
        if signal.happened() {
            return Err(Failure::Failed("interrupted; the module has no program now".into()));
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

/// Why a download is refused.
fn explain(error: Error) -> Failure {
    if error.is(Status::EepromLocked) {
        let lift = "\"SGP 81, 0, 0\" lifts the protection; it erases a program that is protected from being read, too";
        return Failure::Failed(format!("program memory is protected (global parameter 81): {lift}"));
    }
    error.into()
}

/// False if the module's code protection keeps the program from being read.
pub fn is_readable(module: &mut Conversation) -> Result<bool, Error> {
    let Some(protection) = global_number(module.spec(), GlobalParameter::CodeProtection) else { return Ok(true) };
    Ok(module.value(Command::new(Opcode::Ggp as u8, protection, 0, 0))? & AGAINST_READING == 0)
}

/// Compares the program in the module with this one.
pub fn verify(module: &mut Conversation, program: &Program, at: u16, signal: &EndSignal) -> Result<(), Failure> {
    if !is_readable(module)? {
        let message = "the program cannot be compared: it is protected from being read (global parameter 81)";
        return Err(Failure::Failed(message.into()));
    }
    let total = program.commands.len();
    let mut progress = Progress::new("comparing the program", total);
    let mut differences = Vec::new();
    for (done, (address, expected)) in (1..).zip(program.placed(at)) {
        if signal.happened() {
            return Err(Failure::Failed("interrupted; the program is loaded but not compared".into()));
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
