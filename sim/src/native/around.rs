//! The surroundings of a firmware on a simulated board, at one moment: its links, the CAN bus, outputs and the EEPROM.

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::fault::CanState;
use tmcm::can::Frame;
use tmcm::canopen::{Bus, BusState, Filters};
use tmcm::device::Outputs;
use tmcm::firmware::Surroundings;
use tmcm::module::{LinkEnds, LinkMode, LinkSettings, Origin, Request, Source};
use tmcm::store::Job;
use tmcm::tmcl::{Reply, can};
use tmcm::units::Micros;

use super::periphery::Periphery;
use super::ports::Arrived;
use super::traffic::Traffic;
use crate::client::Sent;

/// A USB transfer takes a frame of a millisecond: no reply comes sooner. Published hosts count on that: they ask for
/// the speed right after MVP, and would take 0 for "arrived".
const USB_FRAME: Nanos = MILLISECOND;

/// Frames that the CANopen firmware has in a queue on their way to the controller, as on the target. Others wait in the
/// node.
const OUTGOING: usize = 16;

/// The surroundings of a firmware with `AXES` axes.
pub(super) struct Around<'a, const AXES: usize> {
    pub(super) periphery: &'a mut Periphery<AXES>,
    pub(super) traffic: &'a mut Traffic,
    /// The firmware's time.
    now: Micros,
    /// The board's time then. What the firmware does takes the board's clock further.
    arrived: Nanos,
    /// The firmware is to start anew.
    pub(super) restarts: bool,
}

impl<'a, const AXES: usize> Around<'a, AXES> {
    /// The surroundings at the firmware's time `now`.
    pub(super) fn at(now: Micros, periphery: &'a mut Periphery<AXES>, traffic: &'a mut Traffic) -> Self {
        let arrived = periphery.board().now();
        Around { periphery, traffic, now, arrived, restarts: false }
    }
}

impl<const AXES: usize> LinkEnds for Around<'_, AXES> {
    fn now(&self) -> Micros {
        self.now
    }

    fn request(&mut self, source: Source, settings: &LinkSettings) -> Option<Request> {
        self.traffic.served = None;
        if source == Source::Can {
            return self.traffic.frames_in.pop_front().and_then(|frame| can::decode(&frame)).map(Request::Frame);
        }
        while let Some(Arrived { client, echo, request }) = self.traffic.ports.next(source, settings) {
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
        let bytes = self.traffic.ports.answer((source, client), reply, mode, settings.reply_addresses());
        let now = self.periphery.board().now();
        let at = if mode.is_some() {
            on_the_wire(source, self.arrived, now)
        } else {
            // A late reply goes out at once, but not before the replies ahead of it, which may wait for their USB
            // frame.
            let ahead = self.traffic.outbox.iter().filter(|sent| sent.source == source).map(|sent| sent.at).max();
            ahead.map_or(now, |ahead| ahead.max(now))
        };
        let sent = Sent::new(at, source, client, &bytes);
        self.traffic.outbox.extend(if event { sent } else { sent.map(Sent::into_reply) });
    }
}

impl<const AXES: usize> Surroundings for Around<'_, AXES> {
    type Bus = Self;

    fn bus(&mut self) -> Option<&mut Self> {
        Some(self)
    }

    fn set(&mut self, outputs: &Outputs) {
        self.periphery.write(outputs);
    }

    fn keep(&mut self, next: impl FnOnce() -> Option<Job>) -> Option<bool> {
        self.periphery.keep(self.now, next)
    }

    /// Whoever needs the settings here asks the firmware.
    fn put_in_force(&mut self, _: &LinkSettings) {}

    fn restart(&mut self) {
        self.restarts = true;
    }
}

/// The simulated bus takes each frame at once.
impl<const AXES: usize> Bus for Around<'_, AXES> {
    fn state(&self) -> BusState {
        match self.periphery.board().borrow().can() {
            CanState::On => BusState::Active,
            CanState::Passive => BusState::Passive,
            CanState::Off => BusState::Off,
        }
    }

    fn listen_to(&mut self, filters: &Filters) {
        self.traffic.filters.clone_from(filters);
    }

    fn read(&mut self) -> Option<Frame> {
        self.traffic.frames_in.pop_front()
    }

    fn has_overrun(&mut self) -> bool {
        false
    }

    fn settle(&mut self) {}

    fn has_room(&self) -> bool {
        self.traffic.frames_out.len() < OUTGOING
    }

    fn is_empty(&self) -> bool {
        true
    }

    fn write(&mut self, frame: &Frame) {
        self.traffic.frames_out.push_back(*frame);
    }

    fn clear(&mut self) {
        self.traffic.frames_out.clear();
    }

    fn wait(&mut self, _: bool) {}
}

/// When bytes are on the wire that were ready at one time, in answer to bytes that arrived at another.
fn on_the_wire(source: Source, arrived: Nanos, ready: Nanos) -> Nanos {
    match source {
        Source::Usb => ready.max(arrived + USB_FRAME),
        Source::Rs485 | Source::Can => ready,
    }
}
