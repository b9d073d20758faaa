//! The byte links of a virtual module: one [`Port`] for each client, and the bytes that wait for it.

use std::collections::VecDeque;

use tmcm::module::{Links, Message, Mode, Port, Request, Source};
use tmcm::tmcl::Reply;
use tmcm::tmcl::binary::TELEGRAM;
use tmcm::units::Micros;

use crate::virtual_module::Client;

/// Whoever brings bytes knows silences and says so; for the ports all bytes arrive at one time.
const AT: Micros = Micros(0);

struct Entry {
    source: Source,
    client: Client,
    port: Port,
    /// Bytes that cannot be read before something is answered.
    ahead: VecDeque<u8>,
}

/// The ports. That of a new client starts in the mode that global parameter 67 had at the start of the module.
pub(crate) struct Ports(Vec<Entry>);

/// What came of a byte.
pub(crate) struct Arrived {
    pub(crate) source: Source,
    pub(crate) client: Client,
    pub(crate) echo: Vec<u8>,
    pub(crate) request: Option<Request>,
}

impl Ports {
    /// The ports of a module that starts. Links that nobody shares are there from the start.
    pub(crate) fn new(mode: Mode) -> Self {
        let mut ports = Ports(Vec::new());
        for source in [Source::Usb, Source::Rs485] {
            ports.entry(source, Client::default(), mode);
        }
        ports
    }

    fn position(&self, source: Source, client: Client) -> Option<usize> {
        self.0.iter().position(|entry| entry.source == source && entry.client == client)
    }

    fn entry(&mut self, source: Source, client: Client, mode: Mode) -> Option<&mut Entry> {
        let index = self.position(source, client).unwrap_or_else(|| {
            self.0.push(Entry { source, client, port: Port::new(source, mode), ahead: VecDeque::new() });
            self.0.len() - 1
        });
        self.0.get_mut(index)
    }

    /// Bytes have arrived; [`Ports::next`] looks at them.
    pub(crate) fn push(&mut self, source: Source, client: Client, bytes: &[u8], links: &Links) {
        if let Some(entry) = self.entry(source, client, links.start) {
            entry.ahead.extend(bytes);
        }
    }

    /// A client has been silent for so long that an unfinished telegram is given up.
    pub(crate) fn silence(&mut self, source: Source, client: Client) {
        if let Some(entry) = self.position(source, client).and_then(|index| self.0.get_mut(index)) {
            entry.port.silence();
        }
    }

    /// Reads bytes, as far as it is known how to, up to one that leads to something.
    pub(crate) fn next(&mut self, links: &Links) -> Option<Arrived> {
        for Entry { source, client, port, ahead } in &mut self.0 {
            while !port.is_waiting()
                && let Some(byte) = ahead.pop_front()
            {
                let taken = port.push(byte, AT, links);
                if taken.request.is_some() || !taken.echo.is_empty() {
                    let echo = taken.echo.to_vec();
                    return Some(Arrived { source: *source, client: *client, echo, request: taken.request });
                }
            }
        }
        None
    }

    /// The answer to a request, or an event, as [`Port::answer`] has it.
    pub(crate) fn answer(
        &mut self,
        (source, client): (Source, Client),
        reply: Option<&Reply>,
        mode: Option<Mode>,
        links: &Links,
    ) -> Message {
        let entry = self.position(source, client).and_then(|index| self.0.get_mut(index));
        let mut message = Message::new();
        if let Some(entry) = entry {
            // A message has room for every reply.
            let _ = entry.port.answer(reply, mode, links, &mut message);
        }
        message
    }

    /// A client has gone.
    pub(crate) fn forget(&mut self, client: Client) {
        self.0.retain(|entry| entry.client != client || client == Client::default());
    }

    /// The USB cable has been pulled out: who comes next finds a link as it is at the start, in the mode given.
    pub(crate) fn unplug_usb(&mut self, mode: Mode) {
        for Entry { source, port, ahead, .. } in self.0.iter_mut().filter(|entry| entry.source == Source::Usb) {
            *port = Port::new(*source, mode);
            ahead.clear();
        }
    }

    /// How many telegrams the bytes would make that wait.
    pub(crate) fn backlog(&self) -> usize {
        self.0.iter().map(|entry| entry.ahead.len().div_ceil(TELEGRAM)).sum()
    }

    /// True while bytes of this client wait.
    pub(crate) fn owes(&self, client: Client) -> bool {
        self.0.iter().any(|entry| entry.client == client && !entry.ahead.is_empty())
    }
}
