//! The one face of all virtual modules: the firmware's core on the simulated board and the flash image on the emulated
//! microcontroller take each other's place here.

use std::ops::DerefMut;

use hal_sim::board::Board;
use hal_sim::clock::Nanos;
use tmcm::can::Frame;
use tmcm::module::Source;

use crate::client::{Client, Sent};

/// A module with its board, in virtual time. Bytes and frames go in at the present time, which is that to which it has
/// been [run](Self::run_until): what it does may take it further, but what it says then is not said before that time.
pub trait VirtualModule {
    /// Access to the board.
    type Board<'a>: DerefMut<Target = Board>
    where
        Self: 'a;

    /// The board, to look at and to change; but for its power see [`set_power`](Self::set_power).
    fn board_mut(&mut self) -> Self::Board<'_>;

    /// Virtual time since the board was first switched on.
    fn now(&self) -> Nanos;

    /// Lets time pass until `to`.
    fn run_until(&mut self, to: Nanos);

    /// When something happens next that others may want to see.
    fn next_event(&self) -> Option<Nanos>;

    /// Switches the supply off or on. What was on its way is lost.
    fn set_power(&mut self, on: bool);

    /// Pulls the USB cable out or plugs it in. What was half received is forgotten; while it is out nothing arrives, and
    /// what the module says goes to nobody.
    fn plug_usb(&mut self, on: bool);

    /// Bytes from a host arrive.
    fn hear(&mut self, source: Source, client: Client, bytes: &[u8]);

    /// A byte from another module arrives on the RS485 bus.
    fn overhear(&mut self, byte: u8);

    /// Nothing has come from a host for so long that an unfinished telegram is given up.
    fn silence(&mut self, source: Source, client: Client);

    /// Bytes that are on the wire by now, oldest first.
    fn sent(&mut self) -> Option<Sent>;

    /// A frame arrives on the CAN bus.
    fn receive_frame(&mut self, frame: &Frame);

    /// Frames that the module wants on the CAN bus by now, oldest first.
    fn frame(&mut self) -> Option<Frame>;

    /// Its port on the RS485 bus; `None` while that is off.
    fn rs485(&self) -> Option<Rs485>;

    /// How many bytes of a client wait because the module is not ready for them.
    fn unread(&self, source: Source, client: Client) -> usize;

    /// How many frames to it wait for that.
    fn unread_frames(&self) -> usize;

    /// True while a request of this client has not been answered as it will be.
    fn owes(&self, client: Client) -> bool;

    /// A client has gone: it gets no event any more. Requests it has sent are carried out all the same.
    fn forget(&mut self, client: Client);

    /// Clients whose sessions the module's USB link has ended in favour of others since the last call.
    fn take_ended(&mut self) -> Vec<Client> {
        Vec::new()
    }

    /// True while somebody may hear from the module without a further request.
    fn is_busy(&self) -> bool;

    /// Messages for a person since the last call.
    fn take_log(&mut self) -> Vec<String>;

    /// Why the module cannot go on, if so.
    fn stopped(&self) -> Option<String>;
}

/// A port on the RS485 bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rs485 {
    /// Its bit rate.
    pub baud: u64,
    /// For how long the module has to have heard nothing before it sends. `None` if the module sees to that itself: its
    /// bytes are on the wire already.
    pub pause: Option<Nanos>,
}
