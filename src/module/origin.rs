//! Where requests come from, and the answers that go back there.

use core::task::Poll;

use crate::tmcl::Reply;

/// A link that requests come from and replies go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// USB, or TCP in its place: a link between one host and the module.
    Usb,
    /// The RS485 bus.
    Rs485,
    /// The CAN bus.
    Can,
}

/// Where a request came from, and its reply goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The link.
    pub source: Source,
    /// Data bytes of the request's frame on CAN, 7 or 8: its reply has as many. On other links this means nothing.
    pub length: u8,
}

impl From<Source> for Origin {
    fn from(source: Source) -> Self {
        Origin { source, length: 8 }
    }
}

/// The answer to a request: a reply, or `None` where the request is over without a reply. While it is pending the link
/// is to bring no other request; the answer comes by [`Module::next_reply`](super::Module::next_reply).
pub type Answer = Poll<Option<Reply>>;

/// An answer that comes later than the call that brought its request; or the event of command 138.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Due {
    /// Where the answer goes.
    pub to: Origin,
    /// The reply; `None` where the request is over, but global parameter 255 suppresses its reply.
    pub reply: Option<Reply>,
}
