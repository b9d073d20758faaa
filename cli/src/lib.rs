//! The program `tmcl` as a library: the virtual module is what the firmware's own tests run on, too.
//!
//! * [`virtual_module`] - the firmware's core on the simulated board, in virtual time
//! * [`fleet`] - several of them on an RS485 bus and a CAN bus
//! * [`slcan`] - CAN frames as text, and an adapter that speaks so
//! * [`sim`] - the virtual module at the pace of a clock, with links that host software opens
//! * [`link`] - the host's end of a link to a module, whatever it is made of
//! * [`send`] - commands in mnemonic form to a module, replies in words
//! * [`asm`] - the assembler for TMCL programs
//! * [`disasm`] - assembled programs as source again
//! * [`failure`] - how a command ends when it does not succeed

pub mod asm;
pub mod disasm;
pub mod failure;
pub mod fleet;
pub mod link;
mod ports;
pub mod send;
pub mod sim;
pub mod slcan;
pub mod virtual_module;
