//! Bytes and frames on their way between a firmware and the clients of its links.

use std::collections::VecDeque;

use tmcm::can::Frame;
use tmcm::canopen::Filters;
use tmcm::module::{LinkMode, Source};

use super::ports::Ports;
use crate::client::{Client, Sent};

/// Bytes and frames on their way, and which clients wait for what.
#[derive(Default)]
pub(super) struct Traffic {
    /// The module's ends of its byte links.
    pub(super) ports: Ports,
    pub(super) outbox: VecDeque<Sent>,
    /// Frames that have passed the controller and that the firmware has not come to.
    pub(super) frames_in: VecDeque<Frame>,
    pub(super) frames_out: VecDeque<Frame>,
    /// The clients, with their links, whose requests have not been answered, oldest first.
    pub(super) waiting: Vec<(Source, Client)>,
    /// The client whose request was the last to be served; `None` if it came over the CAN bus.
    pub(super) served: Option<Client>,
    /// The frames that a node of CANopen has the controller take.
    pub(super) filters: Filters,
    /// The client that has asked last for the event of command 138, unless it has gone.
    pub(super) subscriber: Option<Client>,
}

impl Traffic {
    /// True while there is something that the firmware has not come to.
    pub(super) fn has_unread(&self) -> bool {
        self.ports.has_unread() || !self.frames_in.is_empty()
    }

    /// Ends the waiting of the first client on a link, and returns that client.
    pub(super) fn answered(&mut self, source: Source) -> Option<Client> {
        let index = self.waiting.iter().position(|(waiting, _)| *waiting == source)?;
        Some(self.waiting.remove(index).1)
    }

    /// A firmware starts, whose byte links start in a mode. What one before it owed its clients is forgotten.
    pub(super) fn start(&mut self, mode: LinkMode) {
        self.ports = Ports::new(mode);
        self.waiting.clear();
        self.subscriber = None;
    }
}
