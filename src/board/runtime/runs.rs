//! A firmware that runs on this board.

use crate::board::boards::chosen::AXES;
use crate::board::stm32f4::can_link::CanLink;
use crate::firmware::OnBoard;

/// A firmware, with what it takes of the board.
pub trait Runs: OnBoard<AXES> + 'static {
    /// What it does with the CAN controller.
    type Can: CanLink + 'static;

    /// Logs who has started.
    fn introduce(&self);
}
