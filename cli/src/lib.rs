//! The program `tmcl` as a library. The firmware's own tests use its virtual modules, too.
//!
//! * [`virtual_module`] - the firmware's core on the simulated board, in virtual time
//! * [`tracer`] - a recorder of the commands that a program in a virtual module executes
//! * [`client`] - the clients that share a link to a module, and the bytes sent to them
//! * [`device`] - the interface of a module to its links: either of the two kinds of virtual modules
//! * [`image`] - a virtual module that runs the flash image on the emulated microcontroller
//! * [`fleet`] - several virtual modules on an RS485 bus and a CAN bus
//! * [`slcan`] - CAN frames as lines of text, and an adapter that exchanges such lines with a host
//! * [`sim`] - virtual modules in real time, with links that host software opens
//! * [`link`] - the host's end of a link to a module
//! * [`conversation`] - requests to one module over a link, with decoded replies
//! * [`send`] - `tmcl send`: commands to a module, replies in words
//! * [`asm`] - `tmcl asm`: the assembler for TMCL programs
//! * [`disasm`] - `tmcl disasm`: the source of an assembled program
//! * [`run`] - `tmcl run`: a program on a virtual module, in virtual time, with trace and plot
//! * [`params`] - `tmcl params`: a module's settings in a file
//! * [`monitor`] - `tmcl monitor`: samples of an axis
//! * [`scan`] - `tmcl scan`: the modules on a link
//! * [`program`] - TMCL programs in files and in a module's program memory
//! * [`load`] - `tmcl load`: a program into a module
//! * [`debug`] - `tmcl debug`: a program in a module, step by step
//! * [`failure`] - the failure of a subcommand, with its exit code
//! * [`signal`] - signals that ask the program to end
//! * [`progress`] - a progress bar

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
