//! A host's adapter on the CAN bus.

use std::io::{Read, Write};
use std::os::fd::AsFd;

use hal_sim::clock::MILLISECOND;

use super::endpoint::{Arrival, Endpoint};
use crate::device::Device;
use crate::fleet::{Fleet, Heard, Node};
use crate::slcan::Adapter;

/// Bytes of the shortest line that makes a frame.
const SHORTEST: usize = 6;

/// A byte link to a host, and the adapter behind it.
#[derive(Debug)]
pub struct HostAdapter<T> {
    /// The bytes.
    pub endpoint: Endpoint<T>,
    adapter: Adapter,
}

impl<T: Read + Write + AsFd> HostAdapter<T> {
    /// An adapter as it is when it is plugged in.
    pub fn new(endpoint: Endpoint<T>) -> Self {
        HostAdapter { endpoint, adapter: Adapter::default() }
    }

    /// Takes what has arrived from the host: frames go on the bus.
    pub fn receive(&mut self, fleet: &mut Fleet<impl Device>) {
        let HostAdapter { endpoint, adapter } = self;
        let number = endpoint.client.0;
        endpoint.receive(fleet.unsent_frames(number) * SHORTEST, |arrival| {
            if let Arrival::Bytes(bytes) = arrival {
                bytes.iter().filter_map(|byte| adapter.push(*byte)).for_each(|frame| fleet.send_can(number, frame));
            }
        });
        self.write();
    }

    /// The frames that have arrived from the host are lost; what it wants of the adapter itself is done.
    pub fn throw_away(&mut self) {
        let HostAdapter { endpoint, adapter } = self;
        endpoint.throw_away(|bytes| {
            bytes.iter().for_each(|byte| {
                adapter.push(*byte);
            })
        });
        self.write();
    }

    /// Something was on the bus.
    pub fn hear(&mut self, heard: &Heard) {
        if heard.from != Node::Adapter(self.endpoint.client.0) {
            self.adapter.hear(&heard.frame, heard.at / MILLISECOND);
            self.write();
        }
    }

    fn write(&mut self) {
        let bytes = self.adapter.take();
        if !bytes.is_empty() {
            // What a host does not read is lost to it.
            self.endpoint.stream.write(&bytes);
        }
    }
}
