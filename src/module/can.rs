//! The CAN bus: which identifiers are the module's, which its replies have, and how long they are.

use core::task::Poll;

use super::link_settings::LinkSettings;
use super::origin::{Answer, Origin, Source};
use super::{Module, Platform};
use crate::can::Frame;
use crate::tmcl::Reply;
use crate::tmcl::can;
use crate::units::Micros;

impl LinkSettings {
    /// A reply as a frame: it has identifier 70, as many bytes as the request, and the low byte of identifier 71 in it,
    /// whichever identifier the request came under.
    #[inline]
    pub fn frame(&self, to: Origin, reply: &Reply) -> Frame {
        can::reply_frame(self.can_id, self.can_reply, to.length, reply)
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Takes a request from the CAN bus. It has one of the module's identifiers (parameters 71 and 83); another one is
    /// not answered.
    ///
    /// Where parameter 70, the identifier of replies, is one of the module's own identifiers, the module receives the replies
    /// of other modules, too. It recognises them by the requests to those modules, so it has to be given all frames; else
    /// frames with other identifiers may be kept from it.
    #[inline(always)]
    pub(super) fn frame(&mut self, now: Micros, frame: can::Request) -> Answer {
        let can::Request { id, command, length } = frame;
        let LinkSettings { can_id, can_secondary, can_reply, .. } = self.link_settings;
        let [_, overheard] = &mut self.overheard;
        if id == can_reply && overheard.is_reply::<AXES>(now, command) {
            return Poll::Ready(None);
        }
        // The second identifier may be that of a group of modules: the others of the group answer as well.
        if id != can_id && id != can_reply {
            let [_, low] = id.as_raw().to_be_bytes();
            overheard.asked::<AXES>(now, low, Some(command));
        }
        if id != can_id && Some(id) != can_secondary {
            return Poll::Ready(None);
        }
        self.obey(now, Origin { source: Source::Can, length }, command)
    }
}
