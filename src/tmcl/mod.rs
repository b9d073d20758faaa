//! TMCL, the Trinamic Motion Control Language, as data: the instruction table, commands, replies and their
//! forms on the wire and on paper. Pure: knows no module.

pub mod binary;
pub mod can;
mod command;
mod instruction;
mod reply;
pub mod text;

pub use command::Command;
pub use instruction::{Field, Instruction, Motor, Opcode};
pub use reply::{Reply, Status};
