//! TMCL programs: what the interpreter has for itself. Everything else a command does is the module's.
//!
//! * `registers` - accumulator, X register, flags
//! * `interrupts` - which events call which handler
//! * `machine` - program counter, call stack, WAIT, and the commands that direct where the program goes
//!
//! Nothing in here loops, waits or knows the time: it is passed in, and a command is one call.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod interrupts;
mod machine;
mod registers;

pub use interrupts::{Interrupts, Signals};
pub use machine::{Awaited, Machine, Mode, Wait, address};
pub use registers::{Condition, ErrorFlag, Errors, Registers};
