//! The program `tmcl` as a library: the virtual module is what the firmware's own tests run on, too.
//!
//! * [`virtual_module`] - the firmware's core on the simulated board, in virtual time
//! * [`tracer`] - the commands that its program executes, recorded
//! * [`client`] - who shares a link to a module, and what is on its way to them
//! * [`device`] - a module, whatever runs it, as its links see it
//! * [`image`] - the flash image on the emulated microcontroller, as such a module
//! * [`fleet`] - several of them on an RS485 bus and a CAN bus
//! * [`slcan`] - CAN frames as text, and an adapter that speaks so
//! * [`sim`] - the virtual module at the pace of a clock, with links that host software opens
//! * [`link`] - the host's end of a link to a module, whatever it is made of
//! * [`conversation`] - a host that talks to one module over a link
//! * [`send`] - commands in mnemonic form to a module, replies in words
//! * [`asm`] - the assembler for TMCL programs
//! * [`disasm`] - assembled programs as source again
//! * [`run`] - a program on a virtual module, in virtual time, with trace and plot
//! * [`params`] - a module's settings into a file and back
//! * [`monitor`] - what an axis does, live
//! * [`scan`] - the modules on a link
//! * [`program`] - TMCL programs: from a file, into a module
//! * [`load`] - a program into a module, checked and started
//! * [`debug`] - a program in a module, step by step
//! * [`failure`] - how a command ends when it does not succeed
//! * [`signal`] - Ctrl-C and other signals that ask for the end, waited for
//! * [`progress`] - how far something has got

pub mod asm;
pub mod client;
pub mod conversation;
pub mod debug;
pub mod device;
pub mod disasm;
pub mod failure;
mod files;
pub mod fleet;
pub mod image;
pub mod link;
pub mod load;
pub mod monitor;
pub mod params;
mod ports;
mod product;
pub mod program;
pub mod progress;
pub mod run;
pub mod scan;
pub mod send;
pub mod signal;
pub mod sim;
pub mod slcan;
pub mod tracer;
pub mod virtual_module;
