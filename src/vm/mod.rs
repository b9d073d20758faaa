//! TMCL programs: the part of the interpreter that needs no hardware. All other commands of a program are executed by
//! the module, as if they came over a link.
//!
//! * `registers` - accumulator, X register, flags
//! * `interrupts` - which events call which handler
//! * `machine` - program counter, call stack, WAIT, and the commands that direct where the program goes
//!
//! Nothing in here loops or waits, and there is no clock: the time is passed in, and each command is one call.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod interrupts;
mod machine;
mod registers;

pub use interrupts::{Interrupts, Signals};
pub use machine::{Awaited, Machine, ProgramState, Wait, address};
pub use registers::{Condition, ErrorFlag, Errors, Registers};
