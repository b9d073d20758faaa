//! The host of the virtual module: downloads the program by telegrams, as into a real module.

use hal_sim::clock::SECOND;
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Received};
use tmcm::tmcl::{Command, Opcode, Status};
use tmcm_sim::NativeModule;
use tmcm_sim::wire::meaning;

use crate::failure::Failure;
use crate::program::Program;

/// Serial address of the module.
pub(super) const ADDRESS: u8 = 1;
/// Longest wait for a reply in virtual time: more than writing a whole program to the EEPROM takes.
const PATIENCE: u64 = 60 * SECOND;

/// Loads a program by commands 132 and 133 (manual section 3.7.38).
pub(super) fn download(module: &mut NativeModule, program: &Program) -> Result<(), Failure> {
    request(module, Command::new(Opcode::EnterDownload as u8, 0, 0, 0), Status::Ok)?;
    for command in &program.commands {
        request(module, *command, Status::Loaded)?;
    }
    request(module, Command::new(Opcode::ExitDownload as u8, 0, 0, 0), Status::Ok)
}

/// Sends a command; fails unless the reply has the status `wanted`.
fn request(module: &mut NativeModule, command: Command, wanted: Status) -> Result<(), Failure> {
    let sent = module.exchange(Source::Usb, binary::encode_command(ADDRESS, command), PATIENCE);
    match sent.and_then(|sent| binary::decode_reply(&sent.telegram()?)) {
        Some(Received { status, .. }) if status == wanted as u8 => Ok(()),
        Some(Received { status, .. }) => {
            let meaning = meaning(status);
            Err(Failure::Failed(format!("the module does not take the program: {command}: status {status} {meaning}")))
        }
        None => Err(Failure::Failed(format!("the module does not take the program: {command}: no reply"))),
    }
}
