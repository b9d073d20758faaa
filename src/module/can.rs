//! The CAN bus: which identifiers are the module's, which its replies have, and how long they are.

use super::{Answer, Links, Module, Platform, Source};
use crate::tmcl::Reply;
use crate::tmcl::can::{self, Frame};
use crate::units::Micros;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Takes a data frame with an 11-bit identifier from the CAN bus. A request has one of the module's
    /// identifiers (parameters 71 and 83) and seven data bytes or more; anything else is not answered. The reply
    /// has identifier 70, as many bytes as the request, and the low byte of identifier 71 in it, whichever
    /// identifier the request came under.
    ///
    /// Where 70 is one of the module's own identifiers, it receives the replies of other modules, too; it knows
    /// them if it was given the requests before. Else there is no need to bring it frames it does not answer.
    pub fn can(&mut self, now: Micros, id: u16, data: &[u8]) -> Answer<Frame> {
        self.update_links();
        let (Some(command), Some(content)) = (can::decode_command(data), data.first_chunk()) else {
            return Answer::None;
        };
        let Links { can_id, can_secondary, can_reply, .. } = self.links;
        let [_, overheard] = &mut self.overheard;
        if id == can_reply && overheard.is_reply(now, *content) {
            return Answer::None;
        }
        // The second identifier may be that of a group: others answer, too.
        if id != can_id && id != can_reply {
            let [_, low] = id.to_be_bytes();
            overheard.asked(now, low, Some(command));
        }
        if id != can_id && (can_secondary == 0 || id != can_secondary) {
            return Answer::None;
        }
        let source = Source::Can { length: data.len().min(8) as u8 };
        let outcome = self.execute(now, source, command);
        Answer::of(outcome, |reply| self.frame(source, reply))
    }

    /// A frame that has become due. What is due on byte links before it is to be fetched first.
    pub fn next_frame(&mut self) -> Option<Frame> {
        let (source, reply) = self.replies.pop_front_if(|(source, _)| matches!(source, Source::Can { .. }))?;
        Some(self.frame(source, &reply))
    }

    fn frame(&self, source: Source, reply: &Reply) -> Frame {
        let length = if let Source::Can { length } = source { length } else { 8 };
        Frame { id: self.links.can_reply, data: can::encode_reply(self.links.can_id, length.into(), reply) }
    }
}
