//! A program on a virtual module, in virtual time, with report, trace and plot.

mod host;
mod mishap;
mod plot;
mod recording;
mod report;
mod rotor;
mod script;
mod session;
pub mod time;
mod trace;

pub use plot::draw;
pub use recording::Recording;
pub use report::{Report, ran, variables};
pub use script::{Action, Event, in_order};
pub use session::{End, Session};
pub use trace::Trace;
