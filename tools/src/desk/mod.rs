//! The desk of virtual modules: lines of the control port are carried out, and virtual time passes by the clock, or
//! paused in steps (`docs/control.md`). The clock is the caller's: moments are spans since a beginning of its own.
//!
//! * `carry_out` - what becomes of a line
//! * `controller` - who gives it
//! * `answer` - what is answered: one line of JSON
//! * `timekeeper`, `pacing` - how virtual time passes
//! * `inquiries` - commands to the firmware whose replies have not come yet
//! * `watch` - values that are told as virtual time passes

mod answer;
mod carry_out;
mod controller;
mod inquiries;
mod pacing;
mod timekeeper;
mod watch;

pub use answer::{Going, Moment, Report, Told, answer};
pub use carry_out::carry_out;
pub use controller::{ControllerId, Outcome, Watcher};
pub use inquiries::Inquiries;
pub use pacing::Pacer;
pub use timekeeper::{Finished, Task, Timekeeper};
pub use watch::Watch;
