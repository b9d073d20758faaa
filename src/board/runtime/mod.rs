//! The code that runs on a board: the start, the owner with the firmware that it serves, the tasks of thread mode, and
//! the hand-over between them. Here is also what happens when the firmware cannot go on.

use super::boards::chosen;

mod around;
mod fault;
mod handover;
mod keeper;
mod owner;
mod runs;
mod safe;
mod tasks;
mod usb_link;

pub use around::Around;
pub use fault::panicked;
pub use owner::Room;
pub use runs::Runs;
pub use tasks::run;

use crate::canopen::Node;
use crate::module::Module;

/// The firmware that speaks TMCL, for the product `P` on this board, with additions `H`: user functions of an image.
pub type Tmcl<P, H = ()> = Module<chosen::Chips<P, H>, { chosen::AXES }>;
/// The node of CANopen, for the product `P` on this board.
pub type Canopen<P> = Node<chosen::Chips<P, ()>>;
