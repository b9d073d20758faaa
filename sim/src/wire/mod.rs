//! The traffic on the wires, in words: telegrams, lines of ASCII mode, and frames of TMCL and CANopen. Nothing here
//! sends anything.
//!
//! * [`Answer`], [`Reply`], [`Meaning`] - a reply by the command that it answers: its parts, and these in words
//! * [`names`] - what the tables of a product say about a command
//! * [`Transcript`] - a line of text for each telegram and frame, in their order: the log of `tmcl sim
//!   --log-telegrams`, and of the other commands on the host's side

mod answer;
pub(crate) mod answering;
mod ascii;
mod canopen;
mod control;
mod line;
pub mod names;
mod reply;
mod talk;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
mod tmcl;
mod transcript;
pub mod words;

pub use answer::{Answer, executed, hexadecimal, meaning};
pub use answering::stays_unanswered;
pub use line::Place;
pub use reply::Reply;
pub use tmcl::reply_in_frame;
pub use transcript::{CAN, Transcript};
pub use words::Meaning;
