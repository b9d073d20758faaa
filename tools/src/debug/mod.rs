//! A program in a module, step by step.
//!
//! TMCL has no breakpoints. The host lets the module execute one command at a time, and compares the program counter
//! with its own list of breakpoints.
//!
//! * `action` - the commands as the user types them
//! * `names`, `quantity`, `place`, `condition` - what the operands of the commands mean
//! * `register`, `subroutine`, `breakpoints` - what is known of the program
//! * `debugger` - carries the commands out
//! * [`state`] - what came of it, as values; `words` makes the text of them

mod action;
mod breakpoints;
mod condition;
mod debugger;
mod names;
mod place;
mod quantity;
mod register;
pub mod state;
mod subroutine;
mod trouble;
pub mod words;

pub use action::{Action, WORDS};
pub use debugger::{Around, Debugger, Read};
pub use register::Register;
pub use trouble::Trouble;
