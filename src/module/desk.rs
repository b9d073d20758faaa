//! The desk between a module and its links: it [serves](serve) the requests of the links and [delivers](deliver) the
//! replies. Board and simulator have the same desk and differ in their [`LinkEnds`].
//!
//! A link brings one command at a time: while the module owes a link a reply, further requests of that link wait in the
//! link's own queue.

use core::task::Poll;

use super::link_settings::{LinkMode, LinkSettings};
use super::origin::{Due, Origin, Source};
use super::port::Request;
use super::{Module, Platform};
use crate::tmcl::Reply;
use crate::tmcl::ascii::Line;
use crate::units::Micros;

/// The links of a module as its desk uses them.
pub trait LinkEnds {
    /// The time.
    fn now(&self) -> Micros;

    /// The next request of a link; `None` while there is none. `settings` are those in force.
    fn request(&mut self, source: Source, settings: &LinkSettings) -> Option<Request>;

    /// True if a link takes an event now: it has room for one besides the reply to a request.
    fn takes_event(&mut self, source: Source) -> bool;

    /// Ends a request of a link, with a reply or, if `reply` is `None`, without; or brings the link an event, which
    /// ends no request. `settings` are those with which the reply is sent. A byte link goes on in `mode`, if one is
    /// given.
    fn answer(&mut self, to: Origin, reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings);
}

/// Serves one request of a link that waits for no reply. False if there is no such request.
///
/// RS485 goes first, then CAN, then USB. The fast links do not starve the slow ones, because their wires take longer
/// than the module. A request on RS485 takes 90 us at 1 Mbit/s, and the reply as long again; a request on CAN takes
/// about 100 us. The module has done with one within 30 us as a rule.
#[inline]
pub fn serve<T: Platform, const AXES: usize>(module: &mut Module<T, AXES>, ends: &mut impl LinkEnds) -> bool {
    // Three calls in place of a loop over the links make the compiler produce a version of `serve_link` for each link.
    // In it nothing is decided by the link any more.
    serve_link(Source::Rs485, module, ends)
        || serve_link(Source::Can, module, ends)
        || serve_link(Source::Usb, module, ends)
}

/// Hands the replies that have become due to their links, and behind them the events that these take. To be called
/// after each [`Module::poll`].
pub fn deliver<T: Platform, const AXES: usize>(module: &mut Module<T, AXES>, ends: &mut impl LinkEnds) {
    while let Some(Due { to, reply }) =
        module.next_reply().or_else(|| module.next_event(|source| ends.takes_event(source)))
    {
        answer(ends, to, reply.as_ref(), None, module.link_settings());
    }
}

/// Serves one request of a link. False if there is none, or if the link waits for a reply.
#[inline(always)]
fn serve_link<T: Platform, const AXES: usize>(
    source: Source,
    module: &mut Module<T, AXES>,
    ends: &mut impl LinkEnds,
) -> bool {
    if module.awaits(source) {
        return false;
    }
    let Some(request) = ends.request(source, module.link_settings()) else { return false };
    match request {
        Request::Line(line) => return serve_line(source, module, ends, line),
        // Frames come over CAN, and nothing else does.
        Request::Frame(_) if source != Source::Can => return true,
        Request::Telegram(_) if source == Source::Can => return true,
        Request::Frame(_) | Request::Telegram(_) => {}
    }
    let (done, mode) = module.request(ends.now(), source, &request);
    let reply = match &done {
        Poll::Ready(Some(reply)) => Some(reply),
        Poll::Ready(None) => None,
        Poll::Pending => return true,
    };
    ends.answer(request.origin(source), reply, Some(mode), module.link_settings());
    true
}

/// Serves a line, which somebody types and for which nobody is in a hurry. A function of its own, so that other
/// requests stay in registers on their way.
#[cold]
#[inline(never)]
fn serve_line<T: Platform, const AXES: usize>(
    source: Source,
    module: &mut Module<T, AXES>,
    ends: &mut impl LinkEnds,
    line: Line,
) -> bool {
    let (done, mode) = module.request(ends.now(), source, &Request::Line(line));
    if let Poll::Ready(reply) = done {
        answer(ends, source.into(), reply.as_ref(), Some(mode), module.link_settings());
    }
    true
}

/// As [`LinkEnds::answer`], which is inlined where time is short.
#[inline(never)]
fn answer(
    ends: &mut impl LinkEnds,
    to: Origin,
    reply: Option<&Reply>,
    mode: Option<LinkMode>,
    settings: &LinkSettings,
) {
    ends.answer(to, reply, mode, settings);
}
