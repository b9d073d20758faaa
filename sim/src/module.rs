//! The one face of all virtual modules: the firmware's core on the simulated board and the flash image on the emulated
//! microcontroller take each other's place here.

use std::ops::DerefMut;

use hal_sim::board::Board;
use hal_sim::clock::Nanos;
use hal_sim::control::{Control, State};
use hal_sim::fault::CanState;
use tmcm::can::Frame;
use tmcm::module::Source;
use tmcm::tmcl::Command;

use crate::client::{Client, Sent};

/// A module with its board, in virtual time.
///
/// Its owner [runs](Self::run_until) it up to a time, which is then the present; bytes and frames arrive at the
/// present. A request may take the module's own clock further than that; the reply is not handed out before the owner
/// has come to its time.
pub trait VirtualModule {
    /// A reference to the board, of the kind that the module can give.
    type BoardMut<'a>: DerefMut<Target = Board>
    where
        Self: 'a;

    /// The board, to look at and to change; its power is switched by [`set_power`](Self::set_power) alone, and its CAN
    /// controller is disturbed by [`set_can`](Self::set_can) alone.
    fn board_mut(&mut self) -> Self::BoardMut<'_>;

    /// Virtual time since the board was first switched on, in nanoseconds, by the module's own clock.
    fn now(&self) -> Nanos;

    /// Lets time pass until `to`.
    fn run_until(&mut self, to: Nanos);

    /// The time of the next event that the owner may want to see: a reply, or a poll of the firmware.
    fn next_event(&self) -> Option<Nanos>;

    /// Switches the supply off or on. Bytes and frames on their way are lost; the EEPROM keeps its contents.
    fn set_power(&mut self, on: bool);

    /// Pulls the USB cable out or plugs it in. A telegram that was received in part is forgotten; while the cable is
    /// out nothing arrives over USB, and what the module sends there is lost.
    fn plug_usb(&mut self, on: bool);

    /// Bytes from a host arrive.
    fn hear(&mut self, source: Source, client: Client, bytes: &[u8]);

    /// A byte from another module arrives on the RS485 bus.
    fn overhear(&mut self, byte: u8);

    /// Ends an unfinished telegram of a client: the client has been silent for too long.
    fn silence(&mut self, source: Source, client: Client);

    /// The next bytes that are on the wire by the present, oldest first.
    fn sent(&mut self) -> Option<Sent>;

    /// A frame arrives on the CAN bus.
    fn receive_frame(&mut self, frame: &Frame);

    /// The next frame that the module wants on the CAN bus by the present, oldest first.
    fn frame(&mut self) -> Option<Frame>;

    /// Disturbs the CAN controller, or lets it recover. While it is off, frames neither leave nor arrive. With the
    /// power off and on it stays as it is.
    fn set_can(&mut self, state: CanState);

    /// Carries out a command of the control protocol; gives the state if that was asked for.
    ///
    /// # Errors
    /// The board has not what the command speaks of.
    fn control(&mut self, control: Control) -> Result<Option<State>, String> {
        match control {
            // What runs on the board, and the ends of its links, have to know of these.
            Control::Power { on } => self.set_power(on),
            Control::Usb { on } => self.plug_usb(on),
            Control::HangUp => self.plug_usb(false),
            Control::Can { state } => self.set_can(state),
            control => return control.apply(&mut self.board_mut()),
        }
        Ok(None)
    }

    /// The module's port on the RS485 bus; `None` while the port is off.
    fn rs485(&self) -> Option<Rs485>;

    /// Number of a client's bytes that wait because the module is not ready for them.
    fn unread(&self, source: Source, client: Client) -> usize;

    /// Number of frames to the module that wait because it is not ready for them.
    fn unread_frames(&self) -> usize;

    /// Whether what hosts send on a link now is heard.
    fn hearing(&self, source: Source) -> Hearing;

    /// True while a request of this client on a byte link waits for its answer. It is also true while bytes of this
    /// client wait to be read, or anything else is on its way to the client.
    fn owes(&self, source: Source, client: Client) -> bool;

    /// True while a host waits for the reply to a request that has come whole, as far as the module can be asked. On a
    /// byte link the host is this client, on the CAN bus anyone. Events and echoes are no replies.
    fn awaits(&self, source: Source, client: Client) -> bool;

    /// Forgets a client that has gone: it gets no event any more. Requests that it has sent are carried out all the
    /// same.
    fn forget(&mut self, client: Client);

    /// Clients whose sessions the module's USB link has ended in favour of others since the last call.
    fn take_ended(&mut self) -> Vec<Client> {
        Vec::new()
    }

    /// True while a reply or an event may still come without a further request.
    fn is_busy(&self) -> bool;

    /// The value that GAP or GGP would read now, at no cost: without a telegram, and nothing on the board or in the
    /// module notices.
    ///
    /// # Errors
    /// Why it cannot be had so, and what to use instead.
    fn peek(&mut self, command: Command) -> Result<i32, String>;

    /// Messages for a person since the last call.
    fn take_log(&mut self) -> Vec<String>;

    /// The reason for which the module cannot go on; `None` while it can.
    fn stopped(&self) -> Option<String>;
}

/// Whether a module hears its hosts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hearing {
    /// The module hears them.
    Now,
    /// The module starts anew, and will hear them then.
    Soon,
    /// The module does not hear them, as long as nobody switches its power on or plugs its cable in.
    Off,
}

/// A port on the RS485 bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rs485 {
    /// The bit rate of the port, in bit/s.
    pub baud: u64,
    /// Silence on the bus, in nanoseconds, that the module waits for before it sends. `None` for a module that waits by
    /// itself: its bytes are on the wire already.
    pub pause: Option<Nanos>,
}
