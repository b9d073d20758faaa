//! Commands that the owner of a fleet sends by itself, such as `send` of the control protocol. Each goes over the USB
//! link of its module, as a host of its own that says nothing else.

use std::task::Poll;

use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{TELEGRAM, Telegram, encode_command};

use super::Fleet;
use crate::client::{Client, Sent};
use crate::module::VirtualModule;

/// The inquiries that have no reply yet, or one that nobody has taken.
#[derive(Debug, Default)]
pub(super) struct Inquiries {
    open: Vec<Inquiry>,
    /// Number of the last one.
    last: u64,
}

#[derive(Debug)]
struct Inquiry {
    client: Client,
    /// Index of the module.
    module: usize,
    /// The bytes that have come back.
    heard: Vec<u8>,
}

impl Inquiries {
    /// Takes what has come over a USB link, if it is for an inquiry; else gives it back.
    pub(super) fn take(&mut self, sent: Sent) -> Option<Sent> {
        if !sent.client.is_inquiry() {
            return Some(sent);
        }
        // What comes for an inquiry that has its reply, an event for example, is for nobody.
        if let Some(inquiry) = self.open.iter_mut().find(|inquiry| inquiry.client == sent.client) {
            inquiry.heard.extend(sent.bytes);
        }
        None
    }
}

impl<M: VirtualModule> Fleet<M> {
    /// Sends a command to the module with this index. [`Fleet::reply_to`] has the reply, once enough time has passed,
    /// as it does by [`Fleet::serve`].
    pub fn ask(&mut self, module: usize, command: Command) -> Client {
        self.inquiries.last += 1;
        let client = Client::of_inquiry(self.inquiries.last);
        self.inquiries.open.push(Inquiry { client, module, heard: Vec::new() });
        // A module takes any address on its USB link; in a log its number tells it from the others.
        let number = u8::try_from(module + 1).unwrap_or(u8::MAX);
        self.hear_usb_of(module, client, &encode_command(number, command));
        client
    }

    /// The reply to an inquiry, which is taken with it; `Ready(None)` if none comes any more.
    pub fn reply_to(&mut self, inquiry: Client) -> Poll<Option<Telegram>> {
        let Some(open) = self.inquiries.open.iter().find(|open| open.client == inquiry) else {
            return Poll::Ready(None);
        };
        let (module, reply) = (open.module, open.heard.first_chunk::<TELEGRAM>().copied());
        if reply.is_none() && self.awaits_usb_of(module, inquiry) {
            return Poll::Pending;
        }
        self.inquiries.open.retain(|open| open.client != inquiry);
        self.forget_usb_of(module, inquiry);
        Poll::Ready(reply)
    }
}
