//! The links of the board as a firmware uses them.

use super::mail::{Outgoing, USB, USB_REQUESTS};
use crate::board::stm32f4::can::{self, Can};
use crate::board::stm32f4::rs485;
use crate::module::{LinkEnds, LinkMode, LinkSettings, Origin, Request, Source};
use crate::tmcl::Reply;
use crate::tmcl::can::decode;

/// The links of the board.
pub struct Ends {
    /// The CAN controller; `None` until it has joined the bus.
    pub(super) can: Option<Can>,
}

impl LinkEnds for Ends {
    #[inline(always)]
    fn request(&mut self, source: Source, _: &LinkSettings) -> Option<Request> {
        match source {
            // Frames that are no requests are passed over.
            Source::Can => loop {
                if let Some(frame) = decode(&self.can.as_mut()?.read()?) {
                    return Some(Request::Frame(frame));
                }
            },
            Source::Rs485 => rs485::request(),
            // While the host has not fetched earlier replies there is no room for the reply to another request.
            Source::Usb if USB.is_full() => None,
            Source::Usb => USB_REQUESTS.try_receive().ok(),
        }
    }

    /// Each link keeps room for the reply of a request, for which a host waits.
    #[cold]
    #[inline(never)]
    fn takes_event(&mut self, source: Source) -> bool {
        match source {
            Source::Rs485 => rs485::takes_event(),
            Source::Usb => USB.free_capacity() > 1,
            Source::Can => can::takes_event(),
        }
    }

    #[inline(always)]
    fn answer(&mut self, to: Origin, reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) {
        let room = match to.source {
            Source::Rs485 => rs485::answer(reply, mode, settings),
            Source::Usb => {
                let addresses = settings.reply_addresses();
                USB.try_send(Outgoing { reply: reply.copied(), mode, addresses }).is_ok()
            }
            Source::Can => {
                if let (Some(can), Some(reply)) = (&mut self.can, reply) {
                    can.write(&settings.frame(to, reply));
                }
                true
            }
        };
        if !room {
            defmt::warn!("more replies than fit, one dropped");
        }
    }
}
