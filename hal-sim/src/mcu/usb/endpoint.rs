//! An endpoint of OTG_FS in one direction (RM0090 34.16.4).

use std::collections::VecDeque;

use crate::mcu::peripheral::field;

/// Bits of the control register.
pub(super) const USBAEP: u32 = 1 << 15;
pub(super) const NAKSTS: u32 = 1 << 17;
pub(super) const STALL: u32 = 1 << 21;
pub(super) const CNAK: u32 = 1 << 26;
pub(super) const SNAK: u32 = 1 << 27;
const EPDIS: u32 = 1 << 30;
pub(super) const EPENA: u32 = 1 << 31;
/// Bits of a control register that act and read zero: CNAK, SNAK, SD0PID, SODDFRM, EPDIS.
const ACTIONS: u32 = 0x7C00_0000;

/// Flags of the interrupt register.
pub(super) const XFRC: u32 = 1;
const EPDISD: u32 = 1 << 1;
pub(super) const STUP: u32 = 1 << 3;
const INEPNE: u32 = 1 << 6;
pub(super) const TXFE: u32 = 1 << 7;

/// An endpoint in one direction.
#[derive(Debug, Default)]
pub(super) struct Endpoint {
    pub(super) ctl: u32,
    pub(super) int: u32,
    pub(super) tsiz: u32,
    /// The words that are to be sent.
    pub(super) fifo: VecDeque<u32>,
}

impl Endpoint {
    /// Most bytes of a packet. `index` is the number of the endpoint, here and below.
    pub(super) fn packet_size(&self, index: usize) -> usize {
        if index == 0 { 64 >> (self.ctl & 3) } else { field(self.ctl, 0, 11) as usize }
    }

    /// How many packets the transfer still has.
    pub(super) fn packets(&self) -> u32 {
        field(self.tsiz, 19, 10)
    }

    /// How many bytes it still has.
    pub(super) fn bytes(&self) -> u32 {
        field(self.tsiz, 0, 19)
    }

    /// Sets both.
    pub(super) fn set_size(&mut self, packets: u32, bytes: u32) {
        self.tsiz = self.tsiz & 0xE000_0000 | packets << 19 | bytes;
    }

    /// Length of the packet that the host can fetch, if there is one.
    pub(super) fn ready(&self, index: usize) -> Option<usize> {
        let length = (self.bytes() as usize).min(self.packet_size(index));
        let on = self.ctl & (EPENA | NAKSTS | USBAEP) == EPENA | USBAEP;
        (on && self.packets() != 0 && self.fifo.len() >= length.div_ceil(4)).then_some(length)
    }

    /// The control register is written.
    pub(super) fn control(&mut self, index: usize, value: u32) {
        let kept = self.ctl & (NAKSTS | EPENA) | if index == 0 { USBAEP } else { 0 };
        self.ctl = value & !(ACTIONS | NAKSTS | EPENA) | kept;
        if value & SNAK != 0 {
            self.ctl |= NAKSTS;
            self.int |= INEPNE;
        }
        if value & CNAK != 0 {
            self.ctl &= !NAKSTS;
            self.int &= !INEPNE;
        }
        if value & EPDIS != 0 && self.ctl & EPENA != 0 {
            self.ctl &= !EPENA;
            self.int |= EPDISD;
        } else if value & EPENA != 0 {
            self.ctl |= EPENA;
        }
    }
}
