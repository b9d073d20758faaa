//! The byte links of a virtual module: one [`LinkPort`] for each client, and the bytes that wait for it.

use std::collections::VecDeque;

use tmcm::module::{LinkMode, LinkPort, LinkSettings, Message, ReplyAddresses, Request, Source};
use tmcm::tmcl::Reply;
use tmcm::units::Micros;

use crate::client::Client;

/// The time of arrival of all bytes, as the ports are told it. Silences, which end unfinished telegrams, are announced
/// by those who bring the bytes.
const AT: Micros = Micros(0);

struct Entry {
    source: Source,
    client: Client,
    port: LinkPort,
    /// Bytes that have not been read; `None` stands for a silence between them.
    ahead: VecDeque<Option<u8>>,
}

/// The ports of all clients. The port of a new client starts in the mode that global parameter 67 had at the start of
/// the module.
#[derive(Default)]
pub(crate) struct Ports {
    entries: Vec<Entry>,
    /// For each link, the index of the client that is read next.
    turns: [usize; 3],
}

/// The request that a client's bytes have led to, or their echo.
pub(crate) struct Arrived {
    pub(crate) client: Client,
    pub(crate) echo: Vec<u8>,
    pub(crate) request: Option<Request>,
}

impl Ports {
    /// The ports of a module that starts. Links that nobody shares are there from the start.
    pub(crate) fn new(mode: LinkMode) -> Self {
        let mut ports = Ports { entries: Vec::new(), turns: [0; 3] };
        for source in [Source::Usb, Source::Rs485] {
            ports.entry(source, Client::default(), mode);
        }
        ports
    }

    fn position(&self, source: Source, client: Client) -> Option<usize> {
        self.entries.iter().position(|entry| entry.source == source && entry.client == client)
    }

    fn find(&mut self, source: Source, client: Client) -> Option<&mut Entry> {
        self.entries.iter_mut().find(|entry| entry.source == source && entry.client == client)
    }

    fn entry(&mut self, source: Source, client: Client, mode: LinkMode) -> Option<&mut Entry> {
        let index = self.position(source, client).unwrap_or_else(|| {
            self.entries.push(Entry { source, client, port: LinkPort::new(source, mode), ahead: VecDeque::new() });
            self.entries.len() - 1
        });
        self.entries.get_mut(index)
    }

    /// Bytes have arrived; [`Ports::next`] looks at them.
    pub(crate) fn push(&mut self, source: Source, client: Client, bytes: &[u8], settings: &LinkSettings) {
        if let Some(entry) = self.entry(source, client, settings.start) {
            entry.ahead.extend(bytes.iter().copied().map(Some));
        }
    }

    /// A client has been silent for so long that an unfinished telegram is given up.
    pub(crate) fn silence(&mut self, source: Source, client: Client) {
        if let Some(Entry { port, ahead, .. }) = self.find(source, client) {
            if ahead.is_empty() {
                port.silence();
            } else {
                ahead.push_back(None);
            }
        }
    }

    /// Reads bytes that have come over a link, as far as it is known how to, up to one that leads to something. Then it
    /// is the next client's turn.
    pub(crate) fn next(&mut self, from: Source, settings: &LinkSettings) -> Option<Arrived> {
        let count = self.entries.len();
        let turn = self.turns.get_mut(from as usize)?;
        for index in (*turn..count).chain(0..count.min(*turn)) {
            let Some(Entry { source, client, port, ahead }) = self.entries.get_mut(index) else { continue };
            while *source == from
                && !port.is_waiting()
                && let Some(heard) = ahead.pop_front()
            {
                let Some(byte) = heard else {
                    port.silence();
                    continue;
                };
                let echo = port.push(byte, AT, || *settings).to_vec();
                let request = port.take();
                if request.is_some() || !echo.is_empty() {
                    *turn = index + 1;
                    return Some(Arrived { client: *client, echo, request });
                }
            }
        }
        None
    }

    /// The answer to a request, or an event, as [`LinkPort::answer`] has it.
    pub(crate) fn answer(
        &mut self,
        (source, client): (Source, Client),
        reply: Option<&Reply>,
        mode: Option<LinkMode>,
        addresses: ReplyAddresses,
    ) -> Message {
        let mut message = Message::new();
        if let Some(entry) = self.find(source, client) {
            // A message has room for every reply.
            let _ = entry.port.answer(reply, mode, addresses, &mut message);
        }
        message
    }

    /// A client has gone.
    pub(crate) fn forget(&mut self, client: Client) {
        self.entries.retain(|entry| entry.client != client || client == Client::default());
    }

    /// The USB cable has been pulled out: who comes next finds a link as it is at the start, in the mode given.
    pub(crate) fn unplug_usb(&mut self, mode: LinkMode) {
        for Entry { source, port, ahead, .. } in self.entries.iter_mut().filter(|entry| entry.source == Source::Usb) {
            *port = LinkPort::new(*source, mode);
            ahead.clear();
        }
    }

    /// How many bytes of a client have not been read.
    pub(crate) fn unread(&self, source: Source, client: Client) -> usize {
        self.position(source, client).and_then(|index| self.entries.get(index)).map_or(0, |entry| entry.ahead.len())
    }

    /// True if a whole request of a client is among the bytes that have not been read.
    pub(crate) fn has_request(&self, source: Source, client: Client, settings: &LinkSettings) -> bool {
        let found = self.position(source, client).and_then(|index| self.entries.get(index));
        let Some(Entry { port, ahead, .. }) = found.filter(|entry| !entry.ahead.is_empty()) else { return false };
        let mut port = port.clone();
        ahead.iter().any(|heard| {
            match heard {
                Some(byte) => drop(port.push(*byte, AT, || *settings)),
                None => port.silence(),
            }
            port.is_ready()
        })
    }

    /// True while bytes of any client have not been read.
    pub(crate) fn has_unread(&self) -> bool {
        self.entries.iter().any(|entry| !entry.ahead.is_empty())
    }
}
