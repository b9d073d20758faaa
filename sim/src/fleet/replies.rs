//! Replies of modules on their way to the hosts' ends of the links, where they may be lost, corrupted or late. These
//! are the faults `reply-drop`, `reply-corrupt` and `reply-delay` of the control protocol. A module knows nothing of
//! them.
//!
//! They are for what answers a request, on whatever link: events, echoes, emergencies, PDOs and heartbeats pass.

use std::collections::VecDeque;

use hal_sim::clock::Nanos;
use hal_sim::control::ReplyFault;
use tmcm::can::Frame;
use tmcm::module::Source;

use super::frames::is_reply;
use crate::client::{Client, Sent};
use crate::native::FirmwareKind;
use crate::pieces::{Pieces, is_line};

/// Bytes or a frame that leave a module at the USB connector or on the CAN bus.
#[derive(Clone, Debug)]
pub(super) enum Leaving {
    /// Bytes to a host.
    Bytes(Sent),
    /// A frame.
    Frame(Frame),
}

/// The fate of a reply.
#[derive(Debug)]
pub(super) enum Fate {
    /// The reply goes on its way, and is there at its time.
    Passes(Sent),
    /// The reply is lost.
    Lost(Sent),
}

/// The way of the replies from one module.
#[derive(Debug, Default)]
struct ReplyPath {
    /// By how much replies are late.
    delay: Nanos,
    /// How many replies are still to be lost, and to be corrupted.
    drop: u32,
    corrupt: u32,
    /// The beginning of a telegram of a module that sends byte by byte.
    pieces: Pieces,
    /// How many replies end with these bytes.
    replies: u64,
}

/// The ways of all modules, and what is late on them.
#[derive(Debug, Default)]
pub(super) struct Replies {
    ways: Vec<ReplyPath>,
    /// The bytes and frames that come late, each with its time and the index of its module, in the order of the times.
    late: VecDeque<(Nanos, usize, Leaving)>,
}

impl Replies {
    /// The ways of so many modules.
    pub(super) fn of(modules: usize) -> Self {
        Replies { ways: (0..modules).map(|_| ReplyPath::default()).collect(), late: VecDeque::new() }
    }

    /// A fault of the replies of a module begins or ends. What is late already stays late.
    pub(super) fn set(&mut self, module: usize, fault: ReplyFault) {
        let Some(way) = self.ways.get_mut(module) else { return };
        match fault {
            ReplyFault::Delay(delay) => way.delay = delay,
            ReplyFault::Drop(count) => way.drop = count,
            ReplyFault::Corrupt(count) => way.corrupt = count,
        }
    }

    /// Decides the fate of bytes of a module. If it sends `piecemeal`, byte by byte, its bytes are collected until a
    /// telegram or a line is whole, as long as there are faults.
    pub(super) fn take(&mut self, module: usize, sent: Sent, piecemeal: bool) -> Vec<Fate> {
        let Some(way) = self.ways.get_mut(module).filter(|way| way.is_faulty()) else {
            return vec![Fate::Passes(sent)];
        };
        if !piecemeal {
            return vec![way.decide(sent)];
        }
        way.replies += sent.replies;
        let mut fates = Vec::new();
        for bytes in way.pieces.push(&sent.bytes) {
            let replies = std::mem::take(&mut way.replies);
            fates.push(way.decide(Sent { bytes, replies, ..sent }));
        }
        fates
    }

    /// Decides the fate of a frame of a module: the time at which it is there, or `None` if it is lost. Controllers
    /// repeat a frame that was disturbed until it is intact; so a host never sees a corrupted one, and it is lost, too.
    pub(super) fn take_frame(
        &mut self,
        module: usize,
        firmware: FirmwareKind,
        frame: &Frame,
        now: Nanos,
    ) -> Option<Nanos> {
        let faulty = self.ways.get_mut(module).filter(|way| way.is_faulty() && is_reply(firmware, frame));
        let Some(way) = faulty else { return Some(now) };
        let lost = way.takes_one(|way| &mut way.drop) || way.takes_one(|way| &mut way.corrupt);
        (!lost).then_some(now + way.delay)
    }

    /// Keeps what is not there before `at`. False if it is there `now`, and nothing late of the same kind is ahead of
    /// it.
    pub(super) fn keep(&mut self, now: Nanos, at: Nanos, module: usize, leaving: &Leaving) -> bool {
        let ahead = self.late.iter().filter(|(_, of, other)| *of == module && other.is_like(leaving));
        let at = ahead.map(|(at, ..)| *at).max().map_or(at, |ahead| ahead.max(at));
        if at <= now {
            return false;
        }
        let behind = self.late.partition_point(|(other, ..)| *other <= at);
        self.late.insert(behind, (at, module, leaving.clone()));
        true
    }

    /// When the first of what is late is there.
    pub(super) fn next_event(&self) -> Option<Nanos> {
        self.late.front().map(|(at, ..)| *at)
    }

    /// Takes the first of what is late and there by now, with its time and the index of its module.
    pub(super) fn arrived(&mut self, now: Nanos) -> Option<(Nanos, usize, Leaving)> {
        self.late.pop_front_if(|(at, ..)| *at <= now)
    }

    /// True while a reply to this client is late.
    pub(super) fn owes(&self, source: Source, client: Client) -> bool {
        let is_its = |leaving: &Leaving| match leaving {
            Leaving::Bytes(sent) => (sent.source, sent.client) == (source, client),
            Leaving::Frame(_) => source == Source::Can,
        };
        self.late.iter().any(|(.., leaving)| is_its(leaving))
    }

    /// Drops what is late on the USB link or on the CAN bus, because the cable of a module was pulled out, or its
    /// controller is off.
    pub(super) fn cut_off(&mut self, module: usize, source: Source) {
        self.late.retain(|(_, of, leaving)| {
            let is_frame = matches!(leaving, Leaving::Frame(_));
            *of != module || is_frame != (source == Source::Can)
        });
    }

    /// Drops what is late, because a module has lost its power. The faults stay.
    pub(super) fn lose(&mut self, module: usize) {
        self.late.retain(|(_, of, _)| *of != module);
        if let Some(way) = self.ways.get_mut(module) {
            (way.pieces, way.replies) = (Pieces::default(), 0);
        }
    }
}

impl ReplyPath {
    /// True while replies do not simply pass.
    fn is_faulty(&self) -> bool {
        self.delay > 0 || self.drop > 0 || self.corrupt > 0 || !self.pieces.held().is_empty()
    }

    fn decide(&mut self, mut sent: Sent) -> Fate {
        if sent.replies == 0 {
            return Fate::Passes(sent);
        }
        if self.takes_one(|way| &mut way.drop) {
            return Fate::Lost(sent);
        }
        if self.takes_one(|way| &mut way.corrupt) {
            corrupt(&mut sent.bytes);
        }
        sent.at += self.delay;
        Fate::Passes(sent)
    }

    /// Counts a reply. True if the count had not come to its end.
    fn takes_one(&mut self, count: impl FnOnce(&mut Self) -> &mut u32) -> bool {
        let count = count(self);
        let left = *count > 0;
        *count = count.saturating_sub(1);
        left
    }
}

impl Leaving {
    /// True for two that go over the same link to the same host, so that one cannot overtake the other.
    fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Leaving::Bytes(one), Leaving::Bytes(other)) => (one.source, one.client) == (other.source, other.client),
            (Leaving::Frame(_), Leaving::Frame(_)) => true,
            _ => false,
        }
    }
}

/// Inverts the checksum of a telegram, or the last character of a line, which has no checksum.
fn corrupt(bytes: &mut [u8]) {
    let behind = if is_line(bytes) { 1 } else { 0 };
    if let Some(byte) = bytes.iter_mut().rev().nth(behind) {
        *byte = !*byte;
    }
}
