//! TMCL, the Trinamic Motion Control Language, as data: the instruction table, commands, replies and their
//! forms on the wire and on paper. Pure: knows no module.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

pub mod ascii;
pub mod binary;
pub mod can;
mod command;
mod instruction;
mod reply;
pub mod text;

pub use command::Command;
pub use instruction::{ALL_AXES, CONFIRMATION, Field, Instruction, MotorField, Opcode};
pub use reply::{Reply, Status};
