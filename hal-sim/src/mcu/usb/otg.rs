//! OTG_FS as a device (RM0090 34.16): endpoints, the shared receive FIFO, a transmit FIFO each.
//!
//! The host drives it by packets. An OUT endpoint takes a packet when it is active and not NAKing. The manual says that
//! EPENA has to be set again for each transfer; this is not asked for. Isochronous endpoints, the host role and sleep
//! are not modelled.

use std::collections::VecDeque;

use super::endpoint::{EPENA, Endpoint, NAKSTS, STALL, STUP, TXFE, USBAEP, XFRC};
use crate::mcu::peripheral::{Access, Peripheral, Refusal, bit, field};

const GOTGCTL: u32 = 0x000;
const GOTGINT: u32 = 0x004;
const GAHBCFG: u32 = 0x008;
const GUSBCFG: u32 = 0x00C;
const GRSTCTL: u32 = 0x010;
const GINTSTS: u32 = 0x014;
const GINTMSK: u32 = 0x018;
const GRXSTSR: u32 = 0x01C;
const GRXSTSP: u32 = 0x020;
const GRXFSIZ: u32 = 0x024;
const DIEPTXF0: u32 = 0x028;
const GCCFG: u32 = 0x038;
const CID: u32 = 0x03C;
const GHWCFG: core::ops::RangeInclusive<u32> = 0x044..=0x050;
const DIEPTXF: core::ops::RangeInclusive<u32> = 0x104..=0x10C;
const DCFG: u32 = 0x800;
const DCTL: u32 = 0x804;
const DSTS: u32 = 0x808;
const DIEPMSK: u32 = 0x810;
const DOEPMSK: u32 = 0x814;
const DAINT: u32 = 0x818;
const DAINTMSK: u32 = 0x81C;
const DIEPEMPMSK: u32 = 0x834;
const IN: core::ops::Range<u32> = 0x900..0x980;
const OUT: core::ops::Range<u32> = 0xB00..0xB80;
const PCGCCTL: u32 = 0xE00;
const FIFOS: core::ops::Range<u32> = 0x1000..0x5000;

/// Registers of an endpoint.
const CTL: u32 = 0x00;
const INT: u32 = 0x08;
const TSIZ: u32 = 0x10;
const TXFSTS: u32 = 0x18;

const ENDPOINTS: usize = 4;
const CORE_ID: u32 = 0x0000_1200;
/// Words of FIFO memory.
const FIFO_WORDS: u32 = 320;

const OTGINT: u32 = 1 << 2;
const RXFLVL: u32 = 1 << 4;
const USBSUSP: u32 = 1 << 11;
const USBRST: u32 = 1 << 12;
const ENUMDNE: u32 = 1 << 13;
const IEPINT: u32 = 1 << 18;
const OEPINT: u32 = 1 << 19;
const SRQINT: u32 = 1 << 30;
/// Flags of GINTSTS that are cleared by writing one.
const CLEARABLE: u32 = 0xF030_FC0A;
/// GOTGINT: the session has ended.
const SEDET: u32 = 1 << 2;

const SDIS: u32 = 1;
const PWRDWN: u32 = 16;
const FULL_SPEED: u32 = 3 << 1;
const AHBIDL: u32 = 1 << 31;
const RXFFLSH: u32 = 1 << 4;
const TXFFLSH: u32 = 1 << 5;

/// Status of an entry of the receive FIFO.
const OUT_DATA: u32 = 2;
const OUT_DONE: u32 = 3;
const SETUP_DONE: u32 = 4;
const SETUP_DATA: u32 = 6;

/// The answer of an endpoint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Handshake {
    /// Taken; with the data, where the host has asked for them.
    Ack(Vec<u8>),
    /// Not now.
    Nak,
    /// Never.
    Stall,
}

/// The controller.
#[derive(Debug)]
pub(in crate::mcu) struct Otg {
    gotgint: u32,
    gahbcfg: u32,
    gusbcfg: u32,
    gintsts: u32,
    gintmsk: u32,
    grxfsiz: u32,
    sizes: [u32; ENDPOINTS],
    gccfg: u32,
    dcfg: u32,
    dctl: u32,
    frame: u32,
    masks: [u32; 2],
    daintmsk: u32,
    diepempmsk: u32,
    pcgcctl: u32,
    session: bool,
    inputs: [Endpoint; ENDPOINTS],
    outputs: [Endpoint; ENDPOINTS],
    /// Entries of the receive FIFO: status words, each followed by its data.
    entries: VecDeque<(u32, VecDeque<u32>)>,
    /// Data of the entry that has been popped.
    data: VecDeque<u32>,
}

impl Otg {
    pub(in crate::mcu) fn new() -> Self {
        Self {
            gotgint: 0,
            gahbcfg: 0,
            gusbcfg: 0xA00,
            gintsts: 0,
            gintmsk: 0,
            grxfsiz: 0x200,
            sizes: [0x0200_0200; ENDPOINTS],
            gccfg: 0,
            dcfg: 0x0220_0000,
            dctl: 1 << SDIS,
            frame: 0,
            masks: [0; 2],
            daintmsk: 0,
            diepempmsk: 0,
            pcgcctl: 0,
            session: false,
            inputs: Default::default(),
            outputs: Default::default(),
            entries: VecDeque::new(),
            data: VecDeque::new(),
        }
    }

    /// Whether the device shows itself to a host.
    pub(super) fn is_attached(&self) -> bool {
        self.session && !bit(self.dctl, SDIS) && bit(self.gccfg, PWRDWN)
    }

    /// The address the device listens to.
    pub(super) fn address(&self) -> u32 {
        field(self.dcfg, 4, 7)
    }

    /// The cable's supply has come or gone.
    pub(super) fn set_session(&mut self, on: bool) {
        if on && !self.session {
            self.gintsts |= SRQINT;
        } else if !on && self.session {
            self.gotgint |= SEDET;
        }
        self.session = on;
    }

    /// The host has reset the bus and found out the speed.
    pub(super) fn bus_reset(&mut self) {
        self.gintsts |= USBRST | ENUMDNE;
        self.entries.clear();
        self.data.clear();
        for (input, output) in self.inputs.iter_mut().zip(&mut self.outputs) {
            (input.int, output.int) = (0, 0);
            input.fifo.clear();
            input.ctl &= !(EPENA | STALL);
            output.ctl = output.ctl & !(EPENA | STALL) | NAKSTS;
        }
        self.inputs[0].ctl |= USBAEP;
        self.outputs[0].ctl |= USBAEP;
    }

    /// Nothing has moved on the bus for 3 ms.
    pub(super) fn suspend(&mut self) {
        self.gintsts |= USBSUSP;
    }

    /// A frame begins.
    pub(super) fn start_of_frame(&mut self) {
        self.frame = (self.frame + 1) & 0x3FFF;
    }

    /// A setup packet: a device takes it whatever it is doing.
    pub(super) fn setup(&mut self, packet: [u8; 8]) {
        self.inputs[0].ctl = self.inputs[0].ctl & !STALL | NAKSTS;
        self.outputs[0].ctl = self.outputs[0].ctl & !STALL | NAKSTS;
        self.entries.push_back((8 << 4 | SETUP_DATA << 17, words(&packet)));
        self.entries.push_back((SETUP_DONE << 17, VecDeque::new()));
    }

    /// A packet to an endpoint.
    pub(super) fn output(&mut self, index: usize, packet: &[u8]) -> Handshake {
        let Some(endpoint) = self.outputs.get_mut(index) else { return Handshake::Stall };
        if endpoint.ctl & STALL != 0 {
            return Handshake::Stall;
        }
        if endpoint.ctl & (USBAEP | NAKSTS) != USBAEP || index != 0 && endpoint.packets() == 0 {
            return Handshake::Nak;
        }
        let left = endpoint.packets().saturating_sub(1);
        let bytes = endpoint.bytes().saturating_sub(packet.len() as u32);
        endpoint.set_size(left, bytes);
        let number = index as u32;
        self.entries.push_back((number | (packet.len() as u32) << 4 | OUT_DATA << 17, words(packet)));
        if left == 0 || packet.len() < endpoint.packet_size(index) {
            endpoint.ctl |= NAKSTS;
            self.entries.push_back((number | OUT_DONE << 17, VecDeque::new()));
        }
        Handshake::Ack(Vec::new())
    }

    /// Whether an endpoint has a packet for the host.
    pub(super) fn has_packet(&self, index: usize) -> bool {
        self.inputs.get(index).is_some_and(|endpoint| endpoint.ready(index).is_some())
    }

    /// The host asks an endpoint for a packet.
    pub(super) fn input(&mut self, index: usize) -> Handshake {
        let Some(endpoint) = self.inputs.get_mut(index) else { return Handshake::Stall };
        if endpoint.ctl & STALL != 0 {
            return Handshake::Stall;
        }
        let Some(length) = endpoint.ready(index) else { return Handshake::Nak };
        let mut packet: Vec<u8> = endpoint.fifo.drain(..length.div_ceil(4)).flat_map(u32::to_le_bytes).collect();
        packet.truncate(length);
        endpoint.set_size(endpoint.packets() - 1, endpoint.bytes() - length as u32);
        if endpoint.packets() == 0 {
            endpoint.ctl &= !EPENA;
            endpoint.int |= XFRC;
        }
        Handshake::Ack(packet)
    }

    /// Takes the first entry out of the receive FIFO.
    fn pop(&mut self) -> u32 {
        let Some((status, data)) = self.entries.pop_front() else { return 0 };
        self.data = data;
        let endpoint = self.outputs.get_mut((status & 0xF) as usize);
        match (field(status, 17, 4), endpoint) {
            (OUT_DONE, Some(endpoint)) => endpoint.int |= XFRC,
            (SETUP_DONE, Some(endpoint)) => endpoint.int |= STUP,
            _ => {}
        }
        status
    }

    /// Words that the transmit FIFO of an endpoint still takes.
    fn room(&self, index: usize) -> u32 {
        let size = self.sizes[index] >> 16;
        size.min(FIFO_WORDS).saturating_sub(self.inputs[index].fifo.len() as u32)
    }

    fn flags(&self, index: usize) -> u32 {
        let empty = if self.inputs[index].fifo.is_empty() { TXFE } else { 0 };
        self.inputs[index].int | empty
    }

    fn daint(&self) -> u32 {
        (0..ENDPOINTS).fold(0, |lines, index| {
            let empty = if bit(self.diepempmsk, index as u32) { TXFE } else { 0 };
            let input = self.flags(index) & (self.masks[0] & !TXFE | empty) != 0;
            let output = self.outputs[index].int & self.masks[1] != 0;
            lines | u32::from(input) << index | u32::from(output) << (16 + index)
        })
    }

    fn gintsts(&self) -> u32 {
        let active = self.daint() & self.daintmsk;
        let flag = |on: bool, mask: u32| if on { mask } else { 0 };
        self.gintsts
            | flag(!self.entries.is_empty(), RXFLVL)
            | flag(active & 0xFFFF != 0, IEPINT)
            | flag(active >> 16 != 0, OEPINT)
            | flag(self.gotgint != 0, OTGINT)
    }

    fn flush(&mut self, value: u32) {
        if value & RXFFLSH != 0 {
            self.entries.clear();
            self.data.clear();
        }
        if value & TXFFLSH != 0 {
            let number = field(value, 6, 5) as usize;
            for (index, endpoint) in self.inputs.iter_mut().enumerate() {
                if number == 0x10 || number == index {
                    endpoint.fifo.clear();
                }
            }
        }
    }

    fn read_endpoint(&self, index: usize, input: bool, register: u32) -> Access<u32> {
        let endpoint = if input { self.inputs.get(index) } else { self.outputs.get(index) };
        let endpoint = endpoint.ok_or(Refusal::Register)?;
        match register {
            CTL => Ok(endpoint.ctl),
            INT if input => Ok(self.flags(index)),
            INT => Ok(endpoint.int),
            TSIZ => Ok(endpoint.tsiz),
            TXFSTS if input => Ok(self.room(index)),
            _ => Err(Refusal::Register),
        }
    }

    fn write_endpoint(&mut self, index: usize, input: bool, register: u32, value: u32) -> Access {
        let endpoint = if input { self.inputs.get_mut(index) } else { self.outputs.get_mut(index) };
        let endpoint = endpoint.ok_or(Refusal::Register)?;
        match register {
            CTL => endpoint.control(index, value),
            INT => endpoint.int &= !value,
            TSIZ => endpoint.tsiz = value,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }
}

fn words(bytes: &[u8]) -> VecDeque<u32> {
    bytes.chunks(4).map(|chunk| chunk.iter().rev().fold(0, |word, &byte| word << 8 | u32::from(byte))).collect()
}

impl Peripheral for Otg {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            GOTGCTL => Ok(u32::from(self.session) << 19 | 1 << 16),
            GOTGINT => Ok(self.gotgint),
            GAHBCFG => Ok(self.gahbcfg),
            GUSBCFG => Ok(self.gusbcfg),
            GRSTCTL => Ok(AHBIDL),
            GINTSTS => Ok(self.gintsts()),
            GINTMSK => Ok(self.gintmsk),
            GRXSTSR => Ok(self.entries.front().map_or(0, |(status, _)| *status)),
            GRXSTSP => Ok(self.pop()),
            GRXFSIZ => Ok(self.grxfsiz),
            DIEPTXF0 => Ok(self.sizes[0]),
            GCCFG => Ok(self.gccfg),
            CID => Ok(CORE_ID),
            _ if GHWCFG.contains(&offset) => Ok(0),
            _ if DIEPTXF.contains(&offset) => Ok(self.sizes[(offset - 0x100) as usize / 4]),
            DCFG => Ok(self.dcfg),
            DCTL => Ok(self.dctl),
            DSTS => Ok(FULL_SPEED | self.frame << 8),
            DIEPMSK => Ok(self.masks[0]),
            DOEPMSK => Ok(self.masks[1]),
            DAINT => Ok(self.daint()),
            DAINTMSK => Ok(self.daintmsk),
            DIEPEMPMSK => Ok(self.diepempmsk),
            PCGCCTL => Ok(self.pcgcctl),
            _ if IN.contains(&offset) => self.read_endpoint((offset - IN.start) as usize / 32, true, offset % 32),
            _ if OUT.contains(&offset) => self.read_endpoint((offset - OUT.start) as usize / 32, false, offset % 32),
            // All FIFO addresses read the shared receive FIFO.
            _ if FIFOS.contains(&offset) => Ok(self.data.pop_front().unwrap_or(0)),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            GOTGCTL => {}
            GOTGINT => self.gotgint &= !value,
            GAHBCFG => self.gahbcfg = value & 0x181,
            GUSBCFG if bit(value, 29) => return Err(Refusal::Use("the host role is not modelled")),
            GUSBCFG => self.gusbcfg = value,
            GRSTCTL => {
                if bit(value, 0) {
                    *self = Self { session: self.session, gusbcfg: self.gusbcfg, gccfg: self.gccfg, ..Self::new() };
                }
                self.flush(value);
            }
            GINTSTS => self.gintsts &= !(value & CLEARABLE),
            GINTMSK => self.gintmsk = value,
            GRXFSIZ => self.grxfsiz = value,
            DIEPTXF0 => self.sizes[0] = value,
            GCCFG => self.gccfg = value,
            _ if DIEPTXF.contains(&offset) => self.sizes[(offset - 0x100) as usize / 4] = value,
            DCFG => self.dcfg = value,
            DCTL => self.dctl = value,
            DIEPMSK => self.masks[0] = value,
            DOEPMSK => self.masks[1] = value,
            DAINTMSK => self.daintmsk = value,
            DIEPEMPMSK => self.diepempmsk = value,
            PCGCCTL => self.pcgcctl = value,
            _ if IN.contains(&offset) => {
                self.write_endpoint((offset - IN.start) as usize / 32, true, offset % 32, value)?
            }
            _ if OUT.contains(&offset) => {
                self.write_endpoint((offset - OUT.start) as usize / 32, false, offset % 32, value)?;
            }
            _ if FIFOS.contains(&offset) => {
                let index = (offset - FIFOS.start) as usize / 0x1000;
                if self.room(index) == 0 {
                    return Err(Refusal::Use("more is written to a FIFO than it takes"));
                }
                self.inputs[index].fifo.push_back(value);
            }
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    /// The global interrupt; there is no wake-up from sleep.
    fn interrupts(&self) -> u32 {
        u32::from(bit(self.gahbcfg, 0) && self.gintsts() & self.gintmsk != 0)
    }

    fn reset(&mut self) {
        *self = Self { session: self.session, ..Self::new() };
    }
}

#[cfg(test)]
mod tests {
    use super::super::endpoint::{CNAK, SNAK};
    use super::*;

    const GET_DEVICE: [u8; 8] = [0x80, 6, 0, 1, 0, 0, 18, 0];

    /// Attached, endpoint 2 active both ways, all interrupts on.
    fn device() -> Otg {
        let mut otg = Otg::new();
        otg.set_session(true);
        for (offset, value) in [
            (GCCFG, 1 << PWRDWN),
            (DCTL, 0),
            (GAHBCFG, 1),
            (GINTMSK, RXFLVL | IEPINT | OEPINT),
            (DIEPMSK, XFRC),
            (DOEPMSK, STUP),
            (DAINTMSK, 0xF_000F),
            (IN.start + 64 + CTL, 64 | USBAEP | SNAK),
            (OUT.start + 64 + TSIZ, 1 << 19 | 64),
            (OUT.start + 64 + CTL, 64 | USBAEP | CNAK | EPENA),
        ] {
            otg.write(offset, value).unwrap();
        }
        assert!(otg.is_attached());
        otg
    }

    #[test]
    fn a_setup_packet_goes_through_the_receive_fifo() {
        let mut otg = device();
        otg.setup(GET_DEVICE);
        assert_eq!(otg.interrupts(), 1);
        assert_eq!(otg.read(GRXSTSP), Ok(8 << 4 | SETUP_DATA << 17));
        assert_eq!((otg.read(FIFOS.start), otg.read(FIFOS.start)), (Ok(0x0100_0680), Ok(0x0012_0000)));
        assert_eq!(otg.read(DAINT), Ok(0));
        assert_eq!(otg.read(GRXSTSP), Ok(SETUP_DONE << 17));
        assert_eq!((otg.read(DAINT), otg.read(OUT.start + INT)), (Ok(1 << 16), Ok(STUP)));
        otg.write(OUT.start + INT, STUP).unwrap();
        assert_eq!(otg.interrupts(), 0);
    }

    #[test]
    fn a_packet_goes_to_the_host_when_it_is_whole() {
        let mut otg = device();
        assert_eq!(otg.input(2), Handshake::Nak);
        otg.write(IN.start + 64 + TSIZ, 1 << 19 | 5).unwrap();
        otg.write(IN.start + 64 + CTL, 64 | USBAEP | CNAK | EPENA).unwrap();
        otg.write(FIFOS.start + 0x2000, 0x0403_0201).unwrap();
        assert_eq!(otg.input(2), Handshake::Nak);
        otg.write(FIFOS.start + 0x2000, 5).unwrap();
        assert_eq!(otg.input(2), Handshake::Ack(vec![1, 2, 3, 4, 5]));
        assert_eq!((otg.read(DAINT), otg.read(IN.start + 64 + CTL).unwrap() & EPENA), (Ok(4), 0));
        assert_eq!(otg.input(2), Handshake::Nak);
        otg.write(IN.start + 64 + CTL, 64 | USBAEP | STALL).unwrap();
        assert_eq!(otg.input(2), Handshake::Stall);
    }

    #[test]
    fn a_packet_is_taken_once_until_there_is_room_again() {
        let mut otg = device();
        assert_eq!(otg.output(2, &[7; 9]), Handshake::Ack(Vec::new()));
        assert_eq!(otg.output(2, &[8; 9]), Handshake::Nak);
        assert_eq!(otg.read(GRXSTSP), Ok(2 | 9 << 4 | OUT_DATA << 17));
        assert_eq!([(); 3].map(|()| otg.read(FIFOS.start).unwrap()), [0x0707_0707, 0x0707_0707, 7]);
        assert_eq!(otg.read(GRXSTSP), Ok(2 | OUT_DONE << 17));
        otg.write(OUT.start + 64 + TSIZ, 1 << 19 | 64).unwrap();
        otg.write(OUT.start + 64 + CTL, 64 | USBAEP | CNAK).unwrap();
        assert_eq!(otg.output(2, &[8; 9]), Handshake::Ack(Vec::new()));
    }
}
