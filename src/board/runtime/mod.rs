//! What runs on a board: the start, the owner with the firmware that it serves, the tasks of thread mode, the mailboxes
//! between them, and what happens when the firmware cannot go on.

use super::boards::chosen;

mod canopen;
mod ends;
mod fault;
mod firmware;
mod keeper;
mod mail;
mod owner;
mod safe;
mod tasks;
mod tmcl;
mod usb_link;

pub use ends::Ends;
pub use fault::panicked;
pub use firmware::Firmware;
pub use owner::Room;
pub use tasks::run;

/// The firmware that speaks TMCL, for the product `P` on this board.
pub type Tmcl<P> = tmcl::Tmcl<chosen::Chips<P>, { chosen::AXES }>;
/// The node of CANopen, for the product `P` on this board.
pub type Canopen<P> = canopen::Canopen<chosen::Chips<P>>;
