//! The USB port of the CANopen firmware. Its telegrams are those of TMCL, but there are two commands alone. By that of
//! the version the update tool of the vendor knows a module. The other is that of the factory settings, with which a
//! node that does not know its address starts.

use super::Node;
use super::lost::Lost;
use crate::device::Circuit;
use crate::executor::Product;
use crate::tmcl::binary::Addressed;
use crate::tmcl::{CONFIRMATION, Opcode, Reply, Status};
use crate::units::Micros;

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

/// The number of the command that restores the settings of the factory.
const FACTORY: u8 = Opcode::FactorySettings as u8;

impl<T: Circuit<Product: Product>> Node<T> {
    /// Serves a telegram. As in the TMCL firmware any address will do, because the cable has two ends alone.
    pub fn serve_usb(&mut self, now: Micros, telegram: &Addressed) -> Reply {
        let Addressed { command, intact, .. } = *telegram;
        if !intact {
            return Reply::WRONG_CHECKSUM;
        }
        self.now = now;
        match (command.opcode, command.kind) {
            (VERSION, 0) => Reply::Version(TEXT),
            (VERSION, 1) => Reply::Plain { status: Status::Ok, opcode: VERSION, value: NUMBER },
            (FACTORY, _) if command.value == CONFIRMATION && self.start_with_defaults() => {
                Reply::echo(Status::Ok, command)
            }
            _ => Reply::echo(Status::NotAvailable, command),
        }
    }

    /// Starts a node without an address as node 1 at 1 Mbit/s, with defaults: they are what it has. False if it has an
    /// address.
    fn start_with_defaults(&mut self) -> bool {
        if self.identity.known {
            return false;
        }
        (self.identity.known, self.lost) = (true, Lost::default());
        if !self.device.store().is_unreachable() {
            self.device.store_mut().reset(false);
        }
        self.reset_communication();
        true
    }
}
