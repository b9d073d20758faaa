//! A host's SLCAN adapter on the virtual CAN bus.

use std::io::{Read, Write};

use hal_sim::clock::MILLISECOND;
use rustix::fd::AsFd;
use tmcl_tools::slcan::Adapter;
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::{Fleet, Heard, Node};

use crate::endpoint::{Arrival, Endpoint};

/// Length of the shortest SLCAN line that carries a frame, in bytes.
const SHORTEST: usize = 6;

/// A byte link to a host, and the adapter behind it.
#[derive(Debug)]
pub struct HostAdapter<T> {
    /// The link to the host.
    pub endpoint: Endpoint<T>,
    adapter: Adapter,
}

impl<T: Read + Write + AsFd> HostAdapter<T> {
    /// An adapter whose channel is closed.
    pub fn new(endpoint: Endpoint<T>) -> Self {
        HostAdapter { endpoint, adapter: Adapter::default() }
    }

    /// Reads the host's lines, sends their frames on the bus, and answers the host.
    pub fn receive(&mut self, fleet: &mut Fleet<impl VirtualModule>) {
        let HostAdapter { endpoint, adapter } = self;
        let number = endpoint.client.0;
        endpoint.receive(fleet.unsent_frames(number) * SHORTEST, |arrival| {
            if let Arrival::Bytes(bytes) = arrival {
                bytes.iter().filter_map(|byte| adapter.push(*byte)).for_each(|frame| fleet.send_can(number, frame));
            }
        });
        self.write();
    }

    /// Reads the host's lines, but drops their frames, because no module has power. Commands for the adapter itself are
    /// carried out.
    pub fn throw_away(&mut self) {
        let HostAdapter { endpoint, adapter } = self;
        endpoint.throw_away(|bytes| {
            bytes.iter().for_each(|byte| {
                adapter.push(*byte);
            })
        });
        self.write();
    }

    /// Passes a frame on the bus to the host, unless this adapter has sent the frame.
    pub fn hear(&mut self, heard: &Heard) {
        if heard.from != Node::Adapter(self.endpoint.client.0) {
            self.adapter.hear(&heard.frame, heard.at / MILLISECOND);
            self.write();
        }
    }

    fn write(&mut self) {
        let bytes = self.adapter.take();
        if !bytes.is_empty() {
            // While earlier bytes wait for a host that does not read, further ones are lost.
            self.endpoint.stream.write(&bytes);
        }
    }
}
