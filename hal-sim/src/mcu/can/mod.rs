//! CAN1: bxCAN (RM0090 32.9), as a master without the second controller, on a virtual bus.
//!
//! The bus has a bit rate and perhaps others on it. A frame takes the time of its bits (stuff bits left out). A
//! controller that is alone gets no acknowledgement and becomes error passive; one with another bit rate than the
//! bus destroys frames, and goes bus-off. Silent and loopback mode are refused. In time
//! triggered mode received frames have a time stamp; none are sent with one.

mod bus;
mod errors;
mod fifo;
mod filter;
mod frame;

use std::collections::VecDeque;

use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal, bit, field};
use errors::Errors;
use fifo::{FOVR, FULL, Fifo};
use filter::Filters;
use frame::{Mailbox, frame};

pub use bus::CanBus;
pub use frame::CanFrame;

const MCR: u32 = 0x00;
const MSR: u32 = 0x04;
const TSR: u32 = 0x08;
const RF0R: u32 = 0x0C;
const RF1R: u32 = 0x10;
const IER: u32 = 0x14;
const ESR: u32 = 0x18;
const BTR: u32 = 0x1C;
const TX: core::ops::Range<u32> = 0x180..0x1B0;
const RX: core::ops::Range<u32> = 0x1B0..0x1D0;
const FILTERS: u32 = 0x200;

const INRQ: u32 = 0;
const SLEEP: u32 = 1;
const TXFP: u32 = 2;
const RFLM: u32 = 3;
const NART: u32 = 4;
const ABOM: u32 = 6;
const TTCM: u32 = 7;
const RESET: u32 = 15;
const MCR_MODELLED: u32 = 0x1_80FF;
const MCR_RESET: u32 = 0x1_0002;

const ERRI: u32 = 1 << 2;
const WKUI: u32 = 1 << 3;
const SLAKI: u32 = 1 << 4;

/// Bits of a mailbox in TSR; mailbox n has them 8 n higher.
const RQCP: u32 = 1;
const TXOK: u32 = 1 << 1;
const TERR: u32 = 1 << 3;
const ABRQ: u32 = 1 << 7;

/// Last error codes: stuff, acknowledgement, a dominant bit that is not seen.
const STUFF: u32 = 1;
const ACKNOWLEDGEMENT: u32 = 3;
const DOMINANT: u32 = 5;

/// Bits of an error frame with the pause after it.
const ERROR_BITS: u64 = 20;
/// Recessive bits that end bus-off.
const RECOVERY_BITS: u64 = 128 * 11;

/// The frame that is on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Traffic {
    /// A frame of ours, from mailbox `0`.
    Ours(usize),
    /// A frame of others.
    Theirs(CanFrame),
}

/// The controller.
#[derive(Debug)]
pub struct Can {
    now: Cycles,
    divider: Cycles,
    /// The core clock, to compare bit rates.
    hz: u64,
    mcr: u32,
    msr: u32,
    tsr: u32,
    ier: u32,
    btr: u32,
    errors: Errors,
    /// When bus-off ends, once it may.
    recovers: Cycles,
    mailboxes: [Mailbox; 3],
    /// Order of the requests of the mailboxes; zero where there is none.
    requested: [u64; 3],
    requests: u64,
    /// Mailboxes whose frame is on the bus, and is to be sent now or not at all.
    aborting: [bool; 3],
    fifos: [Fifo; 2],
    filters: Filters,
    bus: CanBus,
    traffic: Option<(Traffic, Cycles)>,
    /// Frames that others want to send.
    others: VecDeque<CanFrame>,
    sent: Vec<(CanFrame, Cycles)>,
}

impl Can {
    pub(super) fn new() -> Self {
        Self {
            now: 0,
            divider: 1,
            hz: 1,
            mcr: MCR_RESET,
            msr: 0xC02,
            tsr: 0x1C00_0000,
            ier: 0,
            btr: 0x0123_0000,
            errors: Errors::default(),
            recovers: NEVER,
            mailboxes: [[0; 4]; 3],
            requested: [0; 3],
            requests: 0,
            aborting: [false; 3],
            fifos: Default::default(),
            filters: Filters::new(),
            bus: CanBus::default(),
            traffic: None,
            others: VecDeque::new(),
            sent: Vec::new(),
        }
    }

    /// Connects the controller to another bus.
    pub fn set_bus(&mut self, bus: CanBus) {
        self.bus = bus;
    }

    /// The bus that it is connected to.
    pub fn bus(&self) -> CanBus {
        self.bus
    }

    /// Whether the controller is to take part in a bus: it neither sleeps nor is being initialised.
    pub(super) fn takes_part(&self) -> bool {
        !bit(self.mcr, INRQ) && !bit(self.mcr, SLEEP)
    }

    /// The pins are not those of the controller: it is on no bus.
    pub(super) fn disconnect(&mut self) {
        self.traffic = None;
        self.others.clear();
    }

    /// Drops what others want to send: there was nobody on the bus to take it.
    pub(super) fn forget(&mut self) {
        self.others.clear();
    }

    /// The core clock.
    pub(super) fn set_core_clock(&mut self, hz: u64) {
        self.hz = hz;
    }

    /// Others send a frame, as soon as the bus is free.
    pub fn send(&mut self, frame: CanFrame) {
        self.others.push_back(frame);
        self.arbitrate(self.now);
    }

    /// How many frames others still want to send.
    pub(super) fn waiting(&self) -> usize {
        self.others.len()
    }

    /// Core cycles of a bit of the controller; none while it takes no part in the traffic.
    pub(super) fn bit_time(&self) -> Option<Cycles> {
        self.is_on().then(|| self.bit())
    }

    /// Frames of the controller that have been on the bus since the last call, with the cycles of their ends.
    pub(super) fn take_ended(&mut self) -> Vec<(CanFrame, Cycles)> {
        std::mem::take(&mut self.sent)
    }

    /// Core cycles of a bit of the controller.
    fn bit(&self) -> Cycles {
        let quanta = 3 + field(self.btr, 16, 4) + field(self.btr, 20, 3);
        self.divider * Cycles::from(quanta) * (Cycles::from(field(self.btr, 0, 10)) + 1)
    }

    /// Whether the controller has the bit rate of the bus, to a hundredth.
    fn in_step(&self) -> bool {
        let rate = self.hz / self.bit().max(1);
        rate.abs_diff(self.bus.bit_rate.into()) * 100 <= u64::from(self.bus.bit_rate)
    }

    /// Whether it takes part in the traffic.
    fn is_on(&self) -> bool {
        self.mcr & 3 == 0 && self.msr & 3 == 0 && !self.errors.bus_off
    }

    /// Whether it is on the bus, at its bit rate: then it hears the frames of others, and acknowledges them.
    pub fn hears(&self) -> bool {
        self.is_on() && self.in_step()
    }

    /// The mailbox that goes first.
    fn next_mailbox(&self) -> Option<usize> {
        let waiting = (0..3).filter(|&index| self.requested[index] != 0);
        if bit(self.mcr, TXFP) {
            waiting.min_by_key(|&index| self.requested[index])
        } else {
            waiting.min_by_key(|&index| frame(&self.mailboxes[index]).rank())
        }
    }

    /// The bus is free at `at`: who sends next.
    fn arbitrate(&mut self, at: Cycles) {
        if self.traffic.is_some() {
            return;
        }
        let ours = self.next_mailbox().filter(|_| self.is_on());
        let theirs = self.others.front().copied().filter(|_| !self.bus.shorted);
        let bit = if self.hears() { self.bit() } else { (self.hz / u64::from(self.bus.bit_rate.max(1))).max(1) };
        self.traffic = match (ours, theirs) {
            (Some(index), theirs)
                if theirs.is_none_or(|frame_| frame(&self.mailboxes[index]).rank() <= frame_.rank()) =>
            {
                let bits = if self.bus.shorted {
                    1 + ERROR_BITS
                } else if self.in_step() && self.bus.inhabited {
                    frame(&self.mailboxes[index]).bits()
                } else {
                    frame(&self.mailboxes[index]).bits() + ERROR_BITS
                };
                Some((Traffic::Ours(index), at + bits * self.bit()))
            }
            (_, Some(frame)) => Some((Traffic::Theirs(frame), at + frame.bits() * bit)),
            (_, None) => None,
        };
    }

    /// The frame on the bus has ended at `at`.
    fn end(&mut self, traffic: Traffic, at: Cycles) {
        match traffic {
            Traffic::Ours(index) if self.bus.shorted => self.fail(index, DOMINANT),
            Traffic::Ours(index) if !self.in_step() => self.fail(index, STUFF),
            Traffic::Ours(index) if !self.bus.inhabited => self.fail(index, ACKNOWLEDGEMENT),
            Traffic::Ours(index) => {
                self.errors.sent();
                self.sent.push((frame(&self.mailboxes[index]), at));
                self.finish(index, RQCP | TXOK);
            }
            Traffic::Theirs(frame) => {
                self.others.pop_front();
                if self.hears() {
                    self.errors.received();
                    self.accept(frame, at);
                } else if self.is_on() {
                    // At another rate it is nothing but errors.
                    self.errors.count_receive();
                    self.error(STUFF);
                }
            }
        }
    }

    fn fail(&mut self, index: usize, code: u32) {
        // An error passive sender that misses an acknowledgement counts no further.
        if code != ACKNOWLEDGEMENT || !self.errors.is_transmitter_passive() {
            self.errors.count_transmit();
        }
        self.error(code);
        if self.errors.bus_off {
            self.recovers = if bit(self.mcr, ABOM) { self.now + RECOVERY_BITS * self.bit() } else { NEVER };
            self.msr |= if self.ier & (1 << 15 | 1 << 10) == 1 << 15 | 1 << 10 { ERRI } else { 0 };
        }
        if bit(self.mcr, NART) || self.errors.bus_off || self.aborting[index] {
            self.finish(index, RQCP | TERR);
        }
    }

    fn error(&mut self, code: u32) {
        self.errors.last = code;
        let enables = [(11, true), (8, self.errors.is_warning()), (9, self.errors.is_passive())];
        if bit(self.ier, 15) && enables.into_iter().any(|(enable, present)| present && bit(self.ier, enable)) {
            self.msr |= ERRI;
        }
    }

    /// A mailbox is free again.
    fn finish(&mut self, index: usize, flags: u32) {
        self.requested[index] = 0;
        self.aborting[index] = false;
        self.mailboxes[index][0] &= !1;
        self.tsr |= flags << (8 * index) | 1 << (26 + index);
    }

    fn accept(&mut self, frame: CanFrame, at: Cycles) {
        let Some((fifo, number)) = self.filters.matches(frame.identifier()) else { return };
        // The time of its start, in bits, which are counted in time triggered mode alone.
        let stamp = if bit(self.mcr, TTCM) { (at / self.bit()).saturating_sub(frame.bits()) as u16 } else { 0 };
        self.fifos[fifo].push(frame, u32::from(stamp) << 16 | number << 8, bit(self.mcr, RFLM));
    }

    fn write_mcr(&mut self, value: u32) -> Access {
        if value & !MCR_MODELLED != 0 {
            return Err(Refusal::Use("reserved bits of MCR"));
        }
        if bit(value, RESET) {
            self.reset();
            return Ok(());
        }
        let initialised = bit(self.mcr, INRQ) && !bit(value, INRQ);
        self.mcr = value;
        // Sleep and initialisation are acknowledged at once; on the chip after the frame under way.
        self.msr = self.msr & !3
            | if bit(value, INRQ) {
                1
            } else if bit(value, SLEEP) {
                2
            } else {
                0
            };
        if bit(value, INRQ)
            && let Some((Traffic::Ours(_), _)) = self.traffic
        {
            self.traffic = None;
        }
        if initialised && self.errors.bus_off && self.recovers == NEVER {
            self.recovers = self.now + RECOVERY_BITS * self.bit();
        }
        self.arbitrate(self.now);
        Ok(())
    }

    fn write_tsr(&mut self, value: u32) {
        for index in 0..3 {
            let flags = value >> (8 * index);
            if flags & RQCP != 0 {
                self.tsr &= !((RQCP | TXOK | 1 << 2 | TERR) << (8 * index));
            }
            if flags & ABRQ != 0 && self.requested[index] != 0 {
                let busy = matches!(self.traffic, Some((Traffic::Ours(sending), _)) if sending == index);
                if busy {
                    self.aborting[index] = true;
                } else {
                    self.finish(index, RQCP);
                }
            }
        }
    }
}

impl Peripheral for Can {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            MCR => Ok(self.mcr),
            MSR => Ok(self.msr),
            TSR => {
                let code = (0..3).find(|index| bit(self.tsr, 26 + index)).unwrap_or(0);
                let aborting = (0..3).map(|index| (u32::from(self.aborting[index]) * ABRQ) << (8 * index));
                Ok(aborting.fold(self.tsr | code << 24, |status, flag| status | flag))
            }
            RF0R => Ok(self.fifos[0].state()),
            RF1R => Ok(self.fifos[1].state()),
            IER => Ok(self.ier),
            ESR => Ok(self.errors.status()),
            BTR => Ok(self.btr),
            _ if TX.contains(&offset) => {
                Ok(self.mailboxes[(offset - TX.start) as usize / 16][offset as usize % 16 / 4])
            }
            _ if RX.contains(&offset) => {
                let registers = self.fifos[(offset - RX.start) as usize / 16].first();
                Ok(registers[(offset - RX.start) as usize % 16 / 4])
            }
            _ => self.filters.read(offset.checked_sub(FILTERS).ok_or(Refusal::Register)?),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            MCR => self.write_mcr(value)?,
            MSR => self.msr &= !(value & (ERRI | WKUI | SLAKI)),
            TSR => self.write_tsr(value),
            RF0R => self.fifos[0].write(value),
            RF1R => self.fifos[1].write(value),
            IER => self.ier = value,
            ESR => self.errors.last = field(value, 4, 3),
            BTR if !bit(self.mcr, INRQ) => return Err(Refusal::Use("BTR is written outside initialisation")),
            BTR if value >> 30 != 0 => return Err(Refusal::Use("silent and loopback mode are not modelled")),
            BTR => self.btr = value,
            _ if TX.contains(&offset) => {
                let (index, register) = ((offset - TX.start) as usize / 16, offset as usize % 16 / 4);
                self.mailboxes[index][register] = value;
                if register == 0 && bit(value, 0) {
                    self.requests += 1;
                    self.requested[index] = self.requests;
                    self.tsr &= !(1 << (26 + index));
                    self.arbitrate(self.now);
                }
            }
            _ => self.filters.write(offset.checked_sub(FILTERS).ok_or(Refusal::Register)?, value)?,
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
        if self.recovers <= to {
            self.recovers = NEVER;
            self.errors.recover();
            self.arbitrate(to);
        }
        while let Some((traffic, at)) = self.traffic
            && at <= to
        {
            self.traffic = None;
            self.end(traffic, at);
            self.arbitrate(at);
        }
    }

    fn next_event(&self) -> Cycles {
        self.traffic.map_or(NEVER, |(_, at)| at).min(self.recovers)
    }

    /// Transmission, FIFO 0, FIFO 1, errors.
    fn interrupts(&self) -> u32 {
        let transmitted = bit(self.ier, 0) && self.tsr & (RQCP | RQCP << 8 | RQCP << 16) != 0;
        let received = |fifo: usize| {
            let enables = self.ier >> (1 + 3 * fifo);
            let state = self.fifos[fifo].state();
            bit(enables, 0) && state & 3 != 0
                || bit(enables, 1) && state & FULL != 0
                || bit(enables, 2) && state & FOVR != 0
        };
        let errors = bit(self.ier, 15) && self.msr & ERRI != 0;
        [transmitted, received(0), received(1), errors]
            .into_iter()
            .rev()
            .fold(0, |lines, on| lines << 1 | u32::from(on))
    }

    fn set_divider(&mut self, divider: Cycles) {
        self.divider = divider;
    }

    fn reset(&mut self) {
        *self = Self {
            now: self.now,
            divider: self.divider,
            hz: self.hz,
            bus: self.bus,
            others: std::mem::take(&mut self.others),
            sent: std::mem::take(&mut self.sent),
            ..Self::new()
        };
    }
}

#[cfg(test)]
mod tests;
