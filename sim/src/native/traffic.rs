//! Bytes and frames on their way between a firmware and the clients of its links.

use std::collections::VecDeque;

use hal_sim::board::SharedBoard;
use hal_sim::clock::{MILLISECOND, Nanos};
use tmcm::can::Frame;
use tmcm::module::{LinkEnds, LinkMode, LinkSettings, Origin, Request, Source};
use tmcm::tmcl::{Reply, can};

use super::ports::{Arrived, Ports};
use crate::client::{Client, Sent};

/// A USB transfer takes a frame of a millisecond: no reply comes sooner. Published hosts count on that: they ask for the
/// speed right after MVP, and would take 0 for "arrived".
const USB_FRAME: Nanos = MILLISECOND;

/// What is on its way, and which clients wait for what.
#[derive(Default)]
pub(super) struct Traffic {
    pub(super) outbox: VecDeque<Sent>,
    /// Frames that have passed the controller and that the firmware has not come to.
    pub(super) frames_in: VecDeque<Frame>,
    pub(super) frames_out: VecDeque<Frame>,
    /// The clients, with their links, whose requests have not been answered, oldest first.
    pub(super) waiting: Vec<(Source, Client)>,
    /// The client whose request was the last to be served; `None` if it came over the CAN bus.
    pub(super) served: Option<Client>,
    /// The client that has asked last for the event of command 138, unless it has gone.
    pub(super) subscriber: Option<Client>,
}

impl Traffic {
    /// Ends the waiting of the first client on a link, and returns that client.
    fn answered(&mut self, source: Source) -> Option<Client> {
        let index = self.waiting.iter().position(|(waiting, _)| *waiting == source)?;
        Some(self.waiting.remove(index).1)
    }

    /// Forgets what the firmware, which has ended, owed its clients.
    pub(super) fn forget(&mut self) {
        self.waiting.clear();
        self.subscriber = None;
    }
}

/// The links at the firmware's end, at one moment.
pub(super) struct Ends<'a> {
    pub(super) traffic: &'a mut Traffic,
    pub(super) ports: &'a mut Ports,
    pub(super) board: &'a SharedBoard,
    /// That moment. What the firmware does takes the board's clock further.
    pub(super) arrived: Nanos,
}

impl LinkEnds for Ends<'_> {
    fn request(&mut self, source: Source, settings: &LinkSettings) -> Option<Request> {
        self.traffic.served = None;
        if source == Source::Can {
            return self.traffic.frames_in.pop_front().and_then(|frame| can::decode(&frame)).map(Request::Frame);
        }
        while let Some(Arrived { client, echo, request }) = self.ports.next(source, settings) {
            let at = on_the_wire(source, self.arrived, self.arrived);
            self.traffic.outbox.extend(Sent::new(at, source, client, &echo));
            if request.is_some() {
                self.traffic.waiting.push((source, client));
                self.traffic.served = Some(client);
                return request;
            }
        }
        None
    }

    /// A client's bytes wait here for as long as they have to.
    fn takes_event(&mut self, _: Source) -> bool {
        true
    }

    fn answer(&mut self, to: Origin, reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) {
        let source = to.source;
        if source == Source::Can {
            return self.traffic.frames_out.extend(reply.map(|reply| settings.frame(to, reply)));
        }
        let event = reply.is_some_and(Reply::is_event);
        let Some(client) = (if event { self.traffic.subscriber } else { self.traffic.answered(source) }) else {
            return;
        };
        let bytes = self.ports.answer((source, client), reply, mode, settings.reply_addresses());
        let now = self.board.borrow().now();
        let at = if mode.is_some() {
            on_the_wire(source, self.arrived, now)
        } else {
            // A late reply goes out at once, but not before the replies ahead of it, which may wait for their USB frame.
            let ahead = self.traffic.outbox.iter().filter(|sent| sent.source == source).map(|sent| sent.at).max();
            ahead.map_or(now, |ahead| ahead.max(now))
        };
        let sent = Sent::new(at, source, client, &bytes);
        self.traffic.outbox.extend(if event { sent } else { sent.map(Sent::into_reply) });
    }
}

/// When bytes are on the wire that were ready at one time, in answer to bytes that arrived at another.
fn on_the_wire(source: Source, arrived: Nanos, ready: Nanos) -> Nanos {
    match source {
        Source::Usb => ready.max(arrived + USB_FRAME),
        Source::Rs485 | Source::Can => ready,
    }
}
