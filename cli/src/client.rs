//! Who shares a link to a module, and what is on its way to them.

use hal_sim::clock::Nanos;
use tmcm::module::Source;
use tmcm::tmcl::binary::Telegram;

/// Who sent something, where several share a link, as the connections to a TCP port do. The module does
/// not know of it; replies find their way back by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Client(pub u64);

/// Bytes on their way to the host: a reply, or an echo in ASCII mode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sent {
    /// When they are on the wire.
    pub at: Nanos,
    /// The link they go to.
    pub source: Source,
    /// Whom on that link they are for.
    pub client: Client,
    /// What is sent.
    pub bytes: Vec<u8>,
}

impl Sent {
    /// Something, unless there is nothing to be sent.
    pub(crate) fn new(at: Nanos, source: Source, client: Client, bytes: &[u8]) -> Option<Self> {
        (!bytes.is_empty()).then(|| Sent { at, source, client, bytes: bytes.to_vec() })
    }

    /// The bytes as a telegram, if that is what they are.
    pub fn telegram(&self) -> Option<Telegram> {
        self.bytes.as_slice().try_into().ok()
    }
}
