//! TMCL, the Trinamic Motion Control Language, as data: the instruction table, commands and replies, and their forms in
//! telegrams, in CAN frames and as text. Nothing in here has state beyond a telegram or a line, or depends on a module.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

pub mod ascii;
mod axis_set;
pub mod binary;
pub mod can;
mod command;
mod instruction;
mod reply;
pub mod text;

pub use axis_set::{AxisSet, FIRST_SET};
pub use command::Command;
pub use instruction::{ALL_AXES, CONFIRMATION, Field, Instruction, MotorField, Opcode, SEARCH_STATUS};
pub use reply::{Reply, Status};
