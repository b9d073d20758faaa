//! Values that the CAN controller and the node tell each other, besides frames.

use heapless::Vec;

use crate::can::Frame;

/// State of the CAN controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    /// The controller takes part in the bus.
    Active,
    /// The controller takes part, but has met so many errors that it does not tell others of errors any more.
    Passive,
    /// The controller takes no part.
    Off,
}

/// Where frames have been lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// In the CAN controller, on their way in.
    Controller,
    /// In the queue of frames that are to be sent.
    Transmit,
    /// In a queue of frames that have been received.
    Receive,
}

/// A frame that the node wants to receive; all others may be kept from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// The identifier, of 11 bits.
    pub id: u16,
    /// Remote frames with this identifier, not data frames.
    pub remote: bool,
}

/// The frames that the node wants to receive: commands, SYNC, SDO requests, guarding, the heartbeat of the master, and
/// four PDOs.
pub type Filters = Vec<Filter, 9>;

/// The CAN controller as the node uses it.
pub trait Bus {
    /// The state of the controller.
    fn state(&self) -> BusState;

    /// Has these frames come, and no others.
    fn listen_to(&mut self, filters: &Filters);

    /// The frame that has come first.
    fn read(&mut self) -> Option<Frame>;

    /// True, once, after frames have come for which there was no room.
    fn has_overrun(&mut self) -> bool;

    /// Takes note of frames that have been sent.
    fn settle(&mut self);

    /// True if another frame can be [written](Self::write).
    fn has_room(&self) -> bool;

    /// True while no frame is on its way.
    fn is_empty(&self) -> bool;

    /// Sends a frame as soon as no lower identifier is before it.
    fn write(&mut self, frame: &Frame);

    /// Drops all frames that have not been sent.
    fn clear(&mut self);

    /// The node has sent what it can. It is to be asked again when a frame has gone, if it `waits` for that, or if
    /// frames wait in the controller.
    fn wait(&mut self, waits: bool);
}
