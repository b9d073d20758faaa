//! The commands that have no mnemonic, in words.

use std::borrow::Cow;

use tmcm::tmcl::{Command, Opcode};

/// A command as it is written, and where it has no mnemonic what it asks for.
pub(super) fn command(command: Command) -> Cow<'static, str> {
    match what(command) {
        Some(what) => format!("{command} ({what})").into(),
        None => command.to_string().into(),
    }
}

/// The request of a control command, in words (manual section 3.7.38); `None` for a command that has a mnemonic, or is
/// unknown.
fn what(command: Command) -> Option<&'static str> {
    Some(match Opcode::from_number(command.opcode)? {
        Opcode::StopApplication => "stop program",
        Opcode::RunApplication if command.kind == 0 => "run program",
        Opcode::RunApplication => "run program from address",
        Opcode::StepApplication => "step program",
        Opcode::ResetApplication => "reset program",
        Opcode::EnterDownload => "begin download",
        Opcode::ExitDownload => "end download",
        Opcode::ReadMemory => "read program memory",
        Opcode::ApplicationStatus => "state of program",
        Opcode::FirmwareVersion => "what module is this",
        Opcode::FactorySettings => "factory settings",
        Opcode::PositionReachedEvent => "tell when position is reached",
        Opcode::EnterAscii => "enter ASCII mode",
        Opcode::EnterBootloader => "enter boot loader",
        Opcode::SoftwareReset => "reset module",
        _ => return None,
    })
}
