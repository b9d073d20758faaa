//! The CAN controller as the owner of a firmware has it, whatever the firmware does with it.

use super::can::Can;
use crate::can::Frame;
use crate::canopen::Bus;
use crate::module::LinkSettings;
use crate::tmcl::can::Request;

/// The link of a firmware to the CAN controller, which has joined the bus. All of it is called at the owner's priority.
pub trait CanLink {
    /// The controller as a node of CANopen uses it.
    type Node: Bus;

    /// True if the controller is to send what has waited longest, not the lowest identifier.
    const IN_ORDER: bool;

    /// The link of a controller that has just joined the bus.
    fn new(controller: Can) -> Self;

    /// The controller as a node of CANopen uses it, if the firmware is one.
    fn as_node(&mut self) -> Option<&mut Self::Node> {
        None
    }

    /// The next request of TMCL.
    fn request(&mut self) -> Option<Request> {
        None
    }

    /// True if there is room for an event besides the reply to a request.
    fn takes_event(&self) -> bool {
        false
    }

    /// Sends a reply of TMCL.
    fn answer(&mut self, _: &Frame) {}

    /// Listens to the identifiers of the settings.
    fn put_in_force(&mut self, _: &LinkSettings) {}

    /// A mailbox has become free.
    fn refill(&mut self) {}

    /// Keeps the interrupt of received frames from coming again and again while they cannot be taken.
    fn hold(&self) {}

    /// True if nothing is on its way for which a restart should wait.
    fn has_sent(&self) -> bool {
        true
    }
}
