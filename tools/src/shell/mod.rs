//! A module's direct mode: what a line asks for, what there is to tell, and a motor that moves while a key is held.
//!
//! * `action` - what a line asks for
//! * `state` - what there is to tell, as values
//! * `text` - its text
//! * `jog` - a motor that moves while a key is held
//! * `fuel` - how far it goes on by a key
//! * `owed` - what a jog has changed and not put back

mod action;
mod fuel;
mod jog;
mod owed;
mod state;
mod text;

pub use action::{Action, WORDS};
pub use jog::{Jog, Key, Step};
pub use owed::Owed;
pub use state::{JogEnd, Left, State, Watched};
pub use text::text;
