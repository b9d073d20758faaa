//! Facts that a host has learnt of a device, from its descriptors.

/// Kinds of descriptors.
const INTERFACE: u8 = 4;
const ENDPOINT: u8 = 5;
/// Class of an interface that controls a serial port.
const COMMUNICATION: u8 = 2;
/// Kind of the endpoints that carry a serial port's bytes.
const BULK: u8 = 2;

/// Facts that the host has learnt of the device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UsbDevice {
    /// The device descriptor.
    pub device: Vec<u8>,
    /// The configuration descriptor with all that belongs to it.
    pub configuration: Vec<u8>,
    /// Manufacturer, product and serial number, as far as there are any.
    pub strings: [Option<String>; 3],
    /// Whether it is configured and its port open.
    pub open: bool,
    /// The mistake, in words, if something went wrong.
    pub failed: Option<&'static str>,
}

/// A serial port of a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Port {
    /// Number of the endpoint that takes bytes from the host.
    pub(super) output: usize,
    /// Number of the endpoint that has bytes for the host.
    pub(super) input: usize,
    /// Number of the interface that controls it.
    pub(super) control: u8,
}

impl UsbDevice {
    /// Packet size of endpoint 0: in the device descriptor, once it is known.
    pub(super) fn packet_size(&self) -> usize {
        self.device.get(7).map_or(64, |&size| size.into())
    }

    /// Length of the configuration with all that belongs to it, as its header says.
    pub(super) fn configuration_length(&self) -> u16 {
        match *self.configuration {
            [_, _, low, high, ..] => u16::from_le_bytes([low, high]),
            _ => 9,
        }
    }

    /// Index of the string descriptor of manufacturer, product or serial number; 0 where there is none.
    pub(super) fn string_index(&self, place: usize) -> u8 {
        self.device.get(14 + place).copied().unwrap_or(0)
    }

    /// The serial port that the configuration has; none if it has none.
    pub(super) fn port(&self) -> Option<Port> {
        let mut rest = self.configuration.as_slice();
        let mut port = Port::default();
        while let [length, kind, ..] = *rest {
            let (descriptor, next) = rest.split_at(usize::from(length).clamp(2, rest.len()));
            match (kind, descriptor) {
                (INTERFACE, [_, _, number, _, _, COMMUNICATION, ..]) => port.control = *number,
                (ENDPOINT, [_, _, address, BULK, ..]) => {
                    let number = usize::from(address & 0xF);
                    if address >> 7 == 0 { port.output = number } else { port.input = number }
                }
                _ => {}
            }
            rest = next;
        }
        (port.output != 0 && port.input != 0).then_some(port)
    }
}
