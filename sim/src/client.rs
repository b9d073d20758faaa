//! The clients that share a link to a module, and the bytes sent to them.

use hal_sim::clock::Nanos;
use tmcm::module::Source;
use tmcm::tmcl::binary::Telegram;

/// A host among several that share a link, such as the connections to a TCP port. The firmware does not know clients;
/// replies return to the client whose request they answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Client(pub u64);

impl Client {
    /// The first of those numbers that no host on a link has.
    const INQUIRIES: u64 = 1 << 63;

    /// The host that an inquiry of a fleet is from.
    pub(crate) const fn of_inquiry(number: u64) -> Self {
        Client(Self::INQUIRIES | number)
    }

    /// True for such a host.
    pub(crate) const fn is_inquiry(self) -> bool {
        self.0 >= Self::INQUIRIES
    }
}

/// Bytes on their way to the host: a reply, or an echo in ASCII mode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sent {
    /// When the bytes are sent, in virtual time.
    pub at: Nanos,
    /// The link that carries the bytes.
    pub source: Source,
    /// The client on that link that gets the bytes.
    pub client: Client,
    /// The bytes.
    pub bytes: Vec<u8>,
    /// How many replies to requests end with these bytes. Events and echoes are no replies.
    pub replies: u64,
}

impl Sent {
    /// Bytes to be sent, which are an echo or an event; `None` if there are none.
    pub(crate) fn new(at: Nanos, source: Source, client: Client, bytes: &[u8]) -> Option<Self> {
        (!bytes.is_empty()).then(|| Sent { at, source, client, bytes: bytes.to_vec(), replies: 0 })
    }

    /// The same bytes, which are the reply to a request.
    pub(crate) fn into_reply(self) -> Self {
        Sent { replies: 1, ..self }
    }

    /// The bytes as a telegram; `None` if there are not nine of them.
    pub fn telegram(&self) -> Option<Telegram> {
        self.bytes.as_slice().try_into().ok()
    }
}
