//! Virtual modules, with the TMCL or the CANopen firmware, in virtual time: a host's code is tested against them
//! without a module, a serial port, or waiting.
//!
//! ```
#![doc = include_str!("../examples/ten_lines.rs")]
//! ```
//!
//! * [`native`] - a module that runs the firmware's core on the simulated board
//! * [`image`] - a module that runs the flash image on the emulated microcontroller
//! * [`module`] - the one face of both
//! * [`fleet`] - several modules, of one product or of different ones, on an RS485 bus and a CAN bus
//! * [`client`] - the clients that share a link to a module, and the bytes sent to them
//! * [`wire`] - what goes over the wires, in words
//! * [`protocol`] - the control protocol: the world and the time of a fleet, one line of text at a time
//! * [`scenario`] - the language of `tmcl test`, in which tests of a module are written
//! * [`look`] - the values of the world around a module, by the names that conditions and watches have for them
//! * [`suggest`] - what somebody may have meant who has written an unknown name
//! * [`tracer`] - a recorder of the commands that a program in a module executes
//!
//! World files, switches, loads and faults are those of [`hal_sim`]; links, commands and replies those of [`tmcm`].

pub mod client;
pub mod fleet;
pub mod image;
pub mod look;
pub mod module;
pub mod native;
mod pieces;
pub mod protocol;
pub mod scenario;
pub mod suggest;
pub mod tracer;
pub mod wire;

pub use client::{Client, Sent};
pub use fleet::Fleet;
pub use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
pub use hal_sim::world::config::WorldConfig;
pub use image::ImageModule;
pub use module::VirtualModule;
pub use native::{FirmwareKind, Model, NativeModule, Product};
pub use tmcm::module::Source;
pub use tmcm::tmcl::{binary, text};
