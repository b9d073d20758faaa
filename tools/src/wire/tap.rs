//! Listeners to what goes over a link.

use std::error::Error;
use std::time::Duration;

use tmcm::can::Frame;

/// Hears what goes over a link.
pub trait Tap {
    /// Tells that what follows happens at this time, on a wire that has a clock of its own; on others it happens now.
    fn at(&mut self, _time: Duration) {}

    /// Bytes go out.
    fn out(&mut self, _bytes: &[u8]) {}

    /// Bytes have come.
    fn back(&mut self, _bytes: &[u8]) {}

    /// A frame goes out.
    fn frame_out(&mut self, _frame: &Frame) {}

    /// A frame has come.
    fn frame_back(&mut self, _frame: &Frame) {}

    /// No reply has come in time, or not all of it.
    fn give_up(&mut self) {}

    /// Reports what has gone wrong with listening since the last call, and ends the exchange.
    ///
    /// # Errors
    /// Anything that the listener wants its program to know.
    fn check(&mut self) -> Result<(), Box<dyn Error + Send + Sync>> {
        Ok(())
    }
}

/// Nobody listens.
pub struct Nobody;

impl Tap for Nobody {}
