//! What the CAN controller and the node tell each other, besides frames.

use heapless::Vec;

/// State of the CAN controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    /// The controller takes part in the bus.
    Active,
    /// It takes part, but has met so many errors that it does not tell others of errors any more.
    Passive,
    /// It takes no part.
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
