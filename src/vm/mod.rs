//! TMCL programs: the part of the interpreter that needs no hardware. All other commands of a program are executed by
//! the module, as if a host had sent them.
//!
//! * `registers` - accumulator, X register, flags
//! * `interrupts` - which events call which handler
//! * `machine` - program counter, call stack, run and stop, WAIT
//! * `burst` - arithmetic, jumps, calls and user variables: commands that are executed many in one call
//!
//! No function in here waits for time to pass: the caller passes the time in, and says how many commands may be
//! executed in one call.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod burst;
mod interrupts;
mod machine;
mod registers;

pub use burst::is_brief;
pub use interrupts::{Interrupts, Signals};
pub use machine::{Awaited, Machine, ProgramState, Wait, address};
pub use registers::{Condition, ErrorFlag, Errors, Registers};
