//! How requests and replies lie on a stream of bytes, whatever carries that: nine bytes of a serial link, or lines of
//! an SLCAN adapter. There is no waiting and no reading in it, so every wire uses the same.

mod serial;
mod slcan;

pub use serial::Serial;
pub use slcan::Slcan;

use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;

use super::{LinkError, Tap};

/// Requests as bytes, and replies out of bytes. A wire sends what [`ask`](Framing::ask) gives, and gives what comes to
/// [`take`](Framing::take) until that says how it ends; when its time is over it asks [`give_up`](Framing::give_up).
pub trait Framing {
    /// The bytes of a request. What has come in part before belongs to none.
    ///
    /// # Errors
    /// The request cannot be sent to this address.
    fn ask(&mut self, address: u16, command: Command, tap: &mut dyn Tap) -> Result<Vec<u8>, LinkError>;

    /// How many bytes should be read now at most: what comes behind a reply is late, and read before the next request.
    fn room(&self) -> usize;

    /// Takes bytes that have come since the request, at most as many as there is room for. `Some` when the reply is
    /// there, or there will be none.
    fn take(&mut self, bytes: &[u8], tap: &mut dyn Tap) -> Option<Result<Telegram, LinkError>>;

    /// Takes bytes that came before a request, late replies to earlier ones, which only those who listen hear.
    fn late(&mut self, bytes: &[u8], tap: &mut dyn Tap);

    /// Why there is no reply, when the wait for it is over.
    fn give_up(&mut self) -> LinkError;

    /// Takes the reply of any module from now on, whatever address is in it.
    fn take_any(&mut self) {}
}
