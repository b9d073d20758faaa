//! The USB port of the CANopen firmware. Its telegrams are those of TMCL, but there is one command alone: that of the
//! version, by which the update tool of the vendor knows a module.

use crate::tmcl::binary::Addressed;
use crate::tmcl::{Opcode, Reply, Status};

/// Address of the module in replies.
pub const MODULE_ADDRESS: u8 = 1;
/// Address of the host in replies.
pub const HOST_ADDRESS: u8 = 2;

/// The number of the command that asks for the version.
const VERSION: u8 = Opcode::FirmwareVersion as u8;
/// The version as a text: product and version.
const TEXT: [u8; 8] = *b"1140V320";
/// The version as a number: product, major and minor version.
const NUMBER: i32 = 0x0474_0314;

/// The reply to a telegram. As in the TMCL firmware any address will do, because the cable has two ends alone.
pub fn reply(telegram: &Addressed) -> Reply {
    let Addressed { command, intact, .. } = *telegram;
    if !intact {
        return Reply::WRONG_CHECKSUM;
    }
    match (command.opcode, command.kind) {
        (VERSION, 0) => Reply::Version(TEXT),
        (VERSION, 1) => Reply::Plain { status: Status::Ok, opcode: VERSION, value: NUMBER },
        _ => Reply::echo(Status::NotAvailable, command),
    }
}
