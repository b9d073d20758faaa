//! A host with one port: when it is plugged in it enumerates the device, opens it as a serial port (CDC-ACM) and
//! exchanges bytes with it.
//!
//! Transactions are 50 us apart; a pipe that is not ready is asked again in the next frame of 1 ms.

use std::collections::VecDeque;

use super::device::{Port, UsbDevice};
use super::otg::{Handshake, Otg};
use crate::clock::{MICROSECOND, MILLISECOND, Nanos};

/// Largest packet of the port.
const PACKET: usize = 64;
const FRAME: Nanos = MILLISECOND;
const TRANSACTION: Nanos = 50 * MICROSECOND;
/// From the cable to the reset, and from the reset to the first request.
const DEBOUNCE: Nanos = 100 * MILLISECOND;
const RECOVERY: Nanos = 20 * MILLISECOND;
/// How long a request may take.
const PATIENCE: Nanos = 500 * MILLISECOND;

const GET_DESCRIPTOR: u8 = 6;
const SET_ADDRESS: u8 = 5;
const SET_CONFIGURATION: u8 = 9;
const SET_LINE_CODING: u8 = 0x20;
const SET_CONTROL_LINE_STATE: u8 = 0x22;
const TO_HOST: u8 = 0x80;
const TO_INTERFACE: u8 = 0x21;

const DEVICE: u8 = 1;
const CONFIGURATION: u8 = 2;
const STRING: u8 = 3;
const ENGLISH: u16 = 0x409;
/// The address the device gets.
const ADDRESS: u8 = 7;
/// 115 200 bit/s, one stop bit, no parity, eight bits.
const LINE_CODING: [u8; 7] = [0x00, 0xC2, 0x01, 0, 0, 0, 8];

/// When the module could do something for the host, as against when the host got round to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UsbTimes {
    /// The module's port took the last packet.
    pub taken: Nanos,
    /// The port had its last packet for the host ready.
    pub ready: Nanos,
}

/// The purpose of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Device,
    Address,
    Header,
    Configuration,
    String(usize),
    Configure,
    LineCoding,
    Open,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Setup,
    Data,
    Status,
}

/// A control transfer.
#[derive(Debug)]
struct Transfer {
    purpose: Purpose,
    setup: [u8; 8],
    /// The bytes that are sent, or have been received.
    data: Vec<u8>,
    stage: Stage,
    until: Nanos,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Unplugged,
    /// Waits for the device to show itself.
    Waiting,
    /// The device has shown itself, at this time.
    Seen(Nanos),
    /// The bus has been reset.
    Reset(Nanos),
    Talking,
}

/// The host.
#[derive(Debug)]
pub struct UsbHost {
    state: State,
    /// When it does something next.
    due: Nanos,
    frame: Nanos,
    transfer: Option<Transfer>,
    device: UsbDevice,
    /// The port, once it has been found.
    port: Port,
    outgoing: VecDeque<u8>,
    /// The program on the host does not read what comes.
    deaf: bool,
    /// Full packets behind which a short one is still to come.
    unfinished: Vec<u8>,
    incoming: Vec<(Nanos, Vec<u8>)>,
    times: UsbTimes,
    /// Whether the port has a packet.
    ready: bool,
}

impl UsbHost {
    pub(in crate::mcu) fn new() -> Self {
        Self {
            state: State::Unplugged,
            due: Nanos::MAX,
            frame: 0,
            transfer: None,
            device: UsbDevice::default(),
            port: Port::default(),
            outgoing: VecDeque::new(),
            deaf: false,
            unfinished: Vec::new(),
            incoming: Vec::new(),
            times: UsbTimes::default(),
            ready: false,
        }
    }

    /// Plugs the cable in or out.
    pub(in crate::mcu) fn set_plugged(&mut self, now: Nanos, on: bool, otg: &mut Otg) {
        if on == (self.state != State::Unplugged) {
            return;
        }
        *self = Self { incoming: std::mem::take(&mut self.incoming), ..Self::new() };
        if on {
            self.state = State::Waiting;
            (self.due, self.frame) = (now, now);
        } else {
            otg.suspend();
        }
        otg.set_session(on);
    }

    /// The microcontroller has started anew; to the host its device was gone for a moment.
    pub(in crate::mcu) fn device_lost(&mut self, now: Nanos, otg: &mut Otg) {
        if self.state != State::Unplugged {
            *self = Self { incoming: std::mem::take(&mut self.incoming), ..Self::new() };
            self.state = State::Waiting;
            (self.due, self.frame) = (now, now);
            otg.set_session(true);
        }
    }

    /// Resets the bus and enumerates the device anew, as a host does that starts anew with the cable in.
    pub(in crate::mcu) fn start_anew(&mut self, now: Nanos, otg: &mut Otg) {
        if matches!(self.state, State::Reset(_) | State::Talking) {
            let (incoming, frame) = (std::mem::take(&mut self.incoming), self.frame);
            *self = Self { state: State::Reset(now), due: now, frame, incoming, ..Self::new() };
            otg.bus_reset();
        }
    }

    /// Gives what is known of the device.
    pub fn device(&self) -> &UsbDevice {
        &self.device
    }

    /// Sends bytes to the port, as soon as it is open.
    pub fn send(&mut self, bytes: &[u8]) {
        self.outgoing.extend(bytes);
    }

    /// How many bytes wait for the port.
    pub(in crate::mcu) fn waiting(&self) -> usize {
        self.outgoing.len()
    }

    /// Fetches what the port has, or leaves it there, as a host does whose program does not read. When it is plugged in
    /// anew it fetches.
    pub fn set_reading(&mut self, on: bool) {
        self.deaf = !on;
    }

    /// Takes the transfers that have come from the port since the last call, each with the short packet that ends it,
    /// and when.
    pub fn take(&mut self) -> Vec<(Nanos, Vec<u8>)> {
        std::mem::take(&mut self.incoming)
    }

    /// When the port took and had packets.
    pub fn times(&self) -> UsbTimes {
        self.times
    }

    /// Something has happened to the device at `now`.
    pub(in crate::mcu) fn notice(&mut self, now: Nanos, otg: &Otg) {
        let ready = self.device.open && otg.has_packet(self.port.input);
        if ready && !self.ready {
            self.times.ready = now;
        }
        self.ready = ready;
    }

    /// When it wants to do something.
    pub(in crate::mcu) fn next_event(&self) -> Nanos {
        self.due
    }

    /// Does what is due.
    pub(in crate::mcu) fn advance(&mut self, now: Nanos, otg: &mut Otg) {
        if self.due > now {
            return;
        }
        if self.frame + FRAME <= now {
            self.frame += (now - self.frame) / FRAME * FRAME;
            otg.start_of_frame();
        }
        let next_frame = self.frame + FRAME;
        if !otg.is_attached() && self.state != State::Waiting {
            // The device has taken its pull-up off.
            self.device = UsbDevice::default();
            self.transfer = None;
            self.state = State::Waiting;
        }
        let moved = match self.state {
            State::Unplugged => {
                self.due = Nanos::MAX;
                return;
            }
            State::Waiting => {
                if otg.is_attached() {
                    self.state = State::Seen(now);
                }
                false
            }
            State::Seen(since) => {
                if now >= since + DEBOUNCE {
                    otg.bus_reset();
                    self.state = State::Reset(now);
                }
                false
            }
            State::Reset(since) => {
                if now >= since + RECOVERY {
                    self.state = State::Talking;
                    self.request(now, Purpose::Device);
                }
                false
            }
            State::Talking if self.transfer.is_some() => self.converse(now, otg),
            State::Talking => self.exchange(now, otg),
        };
        self.due = if moved { now + TRANSACTION } else { next_frame };
    }

    /// Begins a control transfer.
    fn request(&mut self, now: Nanos, purpose: Purpose) {
        let get = |kind: u8, index: u8, language: u16, length: u16| {
            (TO_HOST, GET_DESCRIPTOR, u16::from(kind) << 8 | u16::from(index), language, length)
        };
        let (kind, request, value, index, length) = match purpose {
            Purpose::Device => get(DEVICE, 0, 0, 18),
            Purpose::Address => (0, SET_ADDRESS, ADDRESS.into(), 0, 0),
            Purpose::Header => get(CONFIGURATION, 0, 0, 9),
            Purpose::Configuration => get(CONFIGURATION, 0, 0, self.device.configuration_length()),
            Purpose::String(place) => get(STRING, self.device.string_index(place), ENGLISH, 255),
            Purpose::Configure => {
                (0, SET_CONFIGURATION, self.device.configuration.get(5).copied().unwrap_or(1).into(), 0, 0)
            }
            Purpose::LineCoding => {
                (TO_INTERFACE, SET_LINE_CODING, 0, self.port.control.into(), LINE_CODING.len() as u16)
            }
            Purpose::Open => (TO_INTERFACE, SET_CONTROL_LINE_STATE, 3, self.port.control.into(), 0),
        };
        let [[v0, v1], [i0, i1], [l0, l1]] = [value, index, length].map(u16::to_le_bytes);
        let data = if purpose == Purpose::LineCoding { LINE_CODING.to_vec() } else { Vec::new() };
        let setup = [kind, request, v0, v1, i0, i1, l0, l1];
        self.transfer = Some(Transfer { purpose, setup, data, stage: Stage::Setup, until: now + PATIENCE });
    }

    /// Goes on with the control transfer by one transaction; false if the device was not ready.
    fn converse(&mut self, now: Nanos, otg: &mut Otg) -> bool {
        let Some(transfer) = &mut self.transfer else { return false };
        let to_host = transfer.setup[0] & TO_HOST != 0;
        let length = u16::from_le_bytes([transfer.setup[6], transfer.setup[7]]).into();
        let handshake = match transfer.stage {
            Stage::Setup => {
                otg.setup(transfer.setup);
                transfer.stage = if length == 0 { Stage::Status } else { Stage::Data };
                return true;
            }
            Stage::Data if to_host => otg.input(0),
            Stage::Data => otg.output(0, &transfer.data),
            Stage::Status if to_host => otg.output(0, &[]),
            Stage::Status => otg.input(0),
        };
        match handshake {
            Handshake::Nak if now > transfer.until => self.fail("the device does not answer a request"),
            Handshake::Nak => return false,
            Handshake::Stall => self.refused(now),
            Handshake::Ack(packet) => match transfer.stage {
                Stage::Data if to_host => {
                    let short = packet.len() < self.device.packet_size();
                    transfer.data.extend(packet);
                    if short || transfer.data.len() >= length {
                        transfer.stage = Stage::Status;
                    }
                }
                Stage::Data => transfer.stage = Stage::Status,
                _ => self.finish(now, otg),
            },
        }
        true
    }

    fn fail(&mut self, why: &'static str) {
        self.device.failed = Some(why);
        self.transfer = None;
    }

    /// The device refuses the request: that is no harm where it is about a string.
    fn refused(&mut self, now: Nanos) {
        match self.transfer.take().map(|transfer| transfer.purpose) {
            Some(Purpose::String(place)) => self.ask_string(now, place + 1),
            _ => self.fail("the device refuses a request"),
        }
    }

    /// A control transfer is complete: what comes next.
    fn finish(&mut self, now: Nanos, otg: &Otg) {
        let Some(Transfer { purpose, data, .. }) = self.transfer.take() else { return };
        match purpose {
            Purpose::Device => {
                self.device.device = data;
                self.request(now, Purpose::Address);
            }
            Purpose::Address if otg.address() != u32::from(ADDRESS) => {
                self.fail("the device has not taken its address")
            }
            Purpose::Address => self.request(now, Purpose::Header),
            Purpose::Header => {
                self.device.configuration = data;
                self.request(now, Purpose::Configuration);
            }
            Purpose::Configuration => {
                self.device.configuration = data;
                self.ask_string(now, 0);
            }
            Purpose::String(place) => {
                let units: Vec<u16> = data
                    .get(2..)
                    .unwrap_or(&[])
                    .chunks_exact(2)
                    .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
                    .collect();
                if let Some(string) = self.device.strings.get_mut(place) {
                    *string = Some(String::from_utf16_lossy(&units));
                }
                self.ask_string(now, place + 1);
            }
            Purpose::Configure => {
                if let Some(port) = self.device.port() {
                    self.port = port;
                    self.request(now, Purpose::LineCoding);
                } else {
                    self.fail("the device has no serial port");
                }
            }
            Purpose::LineCoding => self.request(now, Purpose::Open),
            Purpose::Open => self.device.open = true,
        }
    }

    /// Asks for the next string that there is from `place` on, then goes on.
    fn ask_string(&mut self, now: Nanos, place: usize) {
        match (place..3).find(|&place| self.device.string_index(place) != 0) {
            Some(place) => self.request(now, Purpose::String(place)),
            None => self.request(now, Purpose::Configure),
        }
    }

    /// Bytes out and in; false if nothing moved.
    fn exchange(&mut self, now: Nanos, otg: &mut Otg) -> bool {
        if !self.device.open {
            return false;
        }
        let Port { output, input, .. } = self.port;
        let mut moved = false;
        if !self.outgoing.is_empty() {
            let packet: Vec<u8> = self.outgoing.iter().take(PACKET).copied().collect();
            if matches!(otg.output(output, &packet), Handshake::Ack(_)) {
                self.outgoing.drain(..packet.len());
                self.times.taken = now;
                moved = true;
            }
        }
        if !self.deaf
            && let Handshake::Ack(packet) = otg.input(input)
        {
            moved = true;
            // The host may fetch a packet in the very step in which it becomes ready, before that is noticed.
            if !core::mem::take(&mut self.ready) {
                self.times.ready = now;
            }
            self.unfinished.extend_from_slice(&packet);
            // A host waits for more while packets are full.
            if packet.len() < PACKET && !self.unfinished.is_empty() {
                self.incoming.push((now, std::mem::take(&mut self.unfinished)));
            }
        }
        moved
    }
}
