//! The modules on a link: every address, and on a serial device every bit rate.
//!
//! Each address is asked for the state of its program, and who answers for its firmware version, which changes nothing
//! in a module. Whoever does not answer both in time does not count: a late reply may be one to an earlier question, at
//! another bit rate. A link that leads to one module whatever the address, such as USB, is noticed.

mod found;
mod rates;
mod scanner;
mod search;

pub use found::Found;
pub use rates::search;
pub use search::{Event, Medium, Search};
