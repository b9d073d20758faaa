//! Writing a program to a module's program memory, and reading it back for comparison (manual section 3.7.38).

use tmcm::param::{AGAINST_READING, AGAINST_WRITING, GlobalParameter};
use tmcm::tmcl::{Command, Opcode, Status};

use super::Program;
use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::global_number;
use crate::progress::Progress;
use crate::stop::Stop;

/// Stops the program in the module and writes the new one from address `at` on. The module's program counter is 0 then.
///
/// After a failure a STOP is written at `at`, so that an incomplete program does not run.
///
/// # Errors
/// The module refuses a command, the link fails, or a signal has come.
pub fn download(
    module: &mut Conversation,
    program: &Program,
    at: u16,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<(), Failure> {
    module.control(Opcode::ResetApplication, 0, 0)?;
    module.control(Opcode::EnterDownload, 0, at.into()).map_err(|error| explain(module, error))?;
    if let Err(broken) = send(module, program, at, stop, progress) {
        // These commands may fail, too; only the first failure is reported.
        let _ = module.control(Opcode::EnterDownload, 0, at.into());
        let _ = module.value(Command::new(Opcode::Stop as u8, 0, 0, 0));
        let _ = module.control(Opcode::ExitDownload, 0, 0);
        // Until here a command that asks the module for anything would have been stored.
        return Err(match broken {
            Broken::Off(failure) => failure,
            Broken::Refused(address, error) => {
                let hint = match &error {
                    error if error.is(Status::InvalidValue) => "; the program does not fit into program memory",
                    error if error.is_refusal() => "",
                    _ => "; what is in the module now is incomplete, so load the program again",
                };
                Failure::Failed(format!("address {address}: {}{hint}", explain(module, error)))
            }
        });
    }
    module.control(Opcode::ExitDownload, 0, 0).map_err(|error| explain(module, error))?;
    Ok(())
}

/// The reason why a download has ended.
enum Broken {
    /// The module has not answered, or refused, the command of this address.
    Refused(u16, Error),
    /// Anything else.
    Off(Failure),
}

/// Sends the commands of a program, each of which the module must store and not execute.
fn send(
    module: &mut Conversation,
    program: &Program,
    at: u16,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<(), Broken> {
    let total = program.commands.len();
    let mut reach = |done| progress(Progress { what: "loading the program", done, total });
    reach(0);
    for (done, (address, command)) in (1..).zip(program.at_addresses(at)) {
        if stop.happened() {
            let message = match at {
                0 => "interrupted; the module has no program now".into(),
                at => format!("interrupted; at address {at} the module has no program now"),
            };
            return Err(Broken::Off(stop.interrupted(&message)));
        }
        let reply = module.request(command).map_err(|error| Broken::Refused(address, error))?;
        if reply.status() != Some(Status::Loaded) {
            let message = "the module has not stored the command, it may have executed it: has it been restarted?";
            return Err(Broken::Off(Failure::Failed(format!("address {address}: {command}: {message}"))));
        }
        reach(done);
    }
    Ok(())
}

/// The failure of a command that would have stored something. Status 5 has two reasons, between which the code
/// protection (global parameter 81) tells.
pub fn explain(module: &mut Conversation, error: Error) -> Failure {
    if !error.is(Status::EepromLocked) {
        return error.into();
    }
    Failure::Failed(match protection(module) {
        Ok(protection) if protection & AGAINST_WRITING != 0 => {
            "program memory is protected (global parameter 81): \"SGP 81, 0, 0\" lifts the protection; it erases a program \
             that is protected from being read, too"
                .into()
        }
        Ok(_) => "the module's EEPROM does not answer, so nothing can be stored; the program is not protected (global \
                  parameter 81). Switch the module off and on; if that does not help, the EEPROM is broken"
            .into(),
        Err(reason) => format!(
            "{error}: the program is protected (global parameter 81) or the EEPROM does not answer; which of them cannot \
             be told: {reason}"
        ),
    })
}

/// The module's code protection; 0 on a product that has none.
fn protection(module: &mut Conversation) -> Result<i32, Error> {
    let Some(protection) = global_number(module.product()?, GlobalParameter::CodeProtection) else { return Ok(0) };
    module.value(Command::new(Opcode::Ggp as u8, protection, 0, 0))
}

/// False if the module's code protection keeps the program from being read.
pub fn is_readable(module: &mut Conversation) -> Result<bool, Error> {
    Ok(protection(module)? & AGAINST_READING == 0)
}

/// Compares the commands in the module, from address `at` on, with a program.
///
/// # Errors
/// A command differs, the program is protected from being read, the link fails, or a signal has come.
pub fn verify(
    module: &mut Conversation,
    program: &Program,
    at: u16,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<(), Failure> {
    if !is_readable(module)? {
        let message = "the program cannot be compared: it is protected from being read (global parameter 81)";
        return Err(Failure::Failed(message.into()));
    }
    let total = program.commands.len();
    let mut reach = |done| progress(Progress { what: "comparing the program", done, total });
    reach(0);
    let mut differences = Vec::new();
    for (done, (address, expected)) in (1..).zip(program.at_addresses(at)) {
        if stop.happened() {
            return Err(stop.interrupted("interrupted; the program is loaded but not compared"));
        }
        let found = module.memory(address)?;
        if found != expected {
            differences.push(format!("address {address}: expected {expected}, found {found}"));
        }
        reach(done);
    }
    match differences.first() {
        None => Ok(()),
        Some(first) => {
            let count = differences.len();
            Err(Failure::Failed(format!("{count} of {total} commands differ; {first}")))
        }
    }
}
