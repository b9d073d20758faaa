//! USART: the asynchronous receiver and transmitter (RM0090 30.6), eight data bits, no parity.
//!
//! The receiver samples the line in the middle of its own bits, whatever the rate at the other end is. A wrong rate
//! gives the wrong bytes and framing errors of a real line.

use std::collections::VecDeque;

use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal, Requests, bit, field};

const SR: u32 = 0x00;
const DR: u32 = 0x04;
const BRR: u32 = 0x08;
const CR1: u32 = 0x0C;
const CR2: u32 = 0x10;
const CR3: u32 = 0x14;
const GTPR: u32 = 0x18;

const FE: u32 = 1 << 1;
const NF: u32 = 1 << 2;
const ORE: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;
/// PE, FE, NF, ORE, IDLE: cleared by reading SR, then DR.
const BY_READING: u32 = 0x1F;

const RE: u32 = 2;
const TE: u32 = 3;
const IDLEIE: u32 = 4;
const RXNEIE: u32 = 5;
const TCIE: u32 = 6;
const TXEIE: u32 = 7;
const UE: u32 = 13;
const OVER8: u32 = 15;
/// SBK, RWU, PS, PCE, WAKE, M.
const CR1_REFUSED: u32 = 0x1E03;

const EIE: u32 = 0;
const DMAR: u32 = 6;
const DMAT: u32 = 7;
const ONEBIT: u32 = 11;
/// Infrared, half duplex, smart card, flow control.
const CR3_REFUSED: u32 = 0x73E;

/// Half bits from the edge of the start bit to its own middle, and to that of the stop bit.
const START_BIT: Cycles = 1;
const STOP_BIT: Cycles = 19;
/// Bits of a frame.
const FRAME: Cycles = 10;

/// Levels on the input, from the time of a falling edge on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// When the start bit begins.
    pub(super) start: Cycles,
    /// When the last bit ends.
    pub(super) end: Cycles,
    /// The bits, the first lowest.
    pub(super) levels: u128,
    /// How many there are.
    pub(super) bits: u32,
}

impl Edge {
    /// The level at `at`, which lies within.
    fn level(&self, at: Cycles) -> bool {
        let length = (self.end - self.start).max(1);
        let index = (at - self.start) * Cycles::from(self.bits) / length;
        self.levels >> index & 1 != 0
    }
}

/// A frame that has been sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frame {
    pub(super) start: Cycles,
    pub(super) end: Cycles,
    pub(super) value: u8,
}

/// A port.
#[derive(Debug)]
pub(super) struct Usart {
    now: Cycles,
    divider: Cycles,
    sr: u32,
    brr: u32,
    cr1: u32,
    cr2: u32,
    cr3: u32,
    gtpr: u32,
    /// The receive data register.
    received: u8,
    /// The transmit data register.
    waiting: Option<u8>,
    sending: Option<Frame>,
    sent: Option<Frame>,
    /// When the idle frame that begins with TE ends.
    ready: Cycles,
    line: VecDeque<Edge>,
    /// When the start bit of the frame being received began.
    receiving: Option<Cycles>,
    /// Whether the middle of the start bit has been low: it is no spike.
    started: bool,
    /// When the line has been idle for a frame.
    idle_at: Cycles,
    status_read: bool,
    /// SR has been read since TC came: the next byte clears it.
    completion_read: bool,
}

impl Usart {
    pub(super) fn new() -> Self {
        Self {
            now: 0,
            divider: 1,
            sr: TXE | TC,
            brr: 0,
            cr1: 0,
            cr2: 0,
            cr3: 0,
            gtpr: 0,
            received: 0,
            waiting: None,
            sending: None,
            sent: None,
            ready: 0,
            line: VecDeque::new(),
            receiving: None,
            started: false,
            idle_at: NEVER,
            status_read: false,
            completion_read: false,
        }
    }

    /// The start bit of what comes in begins now.
    pub(super) fn receive(&mut self, edge: Edge) {
        if bit(self.cr1, UE) && bit(self.cr1, RE) {
            self.line.push_back(edge);
            if self.receiving.is_none() {
                self.receiving = Some(edge.start.max(self.now));
                self.idle_at = NEVER;
            }
        }
    }

    /// The frame whose last bit has just gone out.
    pub(super) fn take_sent(&mut self) -> Option<Frame> {
        self.sent.take()
    }

    /// Core cycles of a bit; none while the port is off.
    pub(super) fn bit_time(&self) -> Option<Cycles> {
        bit(self.cr1, UE).then(|| 2 * self.half_bit())
    }

    /// Core cycles of half a bit.
    fn half_bit(&self) -> Cycles {
        let brr = Cycles::from(self.brr.max(1));
        // With OVER8 the fraction has three bits: mantissa * 8 + fraction.
        let clocks = if bit(self.cr1, OVER8) { brr >> 4 << 3 | brr & 7 } else { brr };
        clocks * self.divider / 2
    }

    fn frame(&self) -> Cycles {
        let stop = if field(self.cr2, 12, 2) == 2 { 1 } else { 0 };
        (FRAME + stop) * 2 * self.half_bit()
    }

    fn level(&self, at: Cycles) -> bool {
        self.line.iter().find(|edge| edge.start <= at && at < edge.end).is_none_or(|edge| edge.level(at))
    }

    /// Decides on the bit whose middle is `at`, and whether it is noisy: of three samples, a sixteenth of a bit apart,
    /// two decide.
    fn vote(&self, at: Cycles) -> (bool, bool) {
        if bit(self.cr3, ONEBIT) {
            return (self.level(at), false);
        }
        let apart = self.half_bit() / 8;
        let high = [at - apart, at, at + apart].into_iter().filter(|&at| self.level(at)).count();
        (high >= 2, high % 3 != 0)
    }

    /// The middle of the start bit that began at `start`, or that of the stop bit, is over.
    fn sample(&mut self, start: Cycles, at: Cycles) {
        if self.started {
            self.end(start, at);
        } else if self.vote(at).0 {
            self.look(start, at);
        } else {
            self.started = true;
        }
    }

    /// Ends the frame that began at `start`.
    fn end(&mut self, start: Cycles, at: Cycles) {
        let half = self.half_bit();
        let votes = |n: Cycles| self.vote(start + (2 * n + 1) * half);
        let value = (1..9).fold(0, |value, n| value | u8::from(votes(n).0) << (n - 1));
        let noisy = (0..10).any(|n| votes(n).1);
        let stop = self.vote(at).0;
        if self.sr & RXNE != 0 {
            self.sr |= ORE;
        } else {
            self.received = value;
            self.sr |= RXNE;
            self.sr |= if stop { 0 } else { FE } | if noisy { NF } else { 0 };
        }
        self.status_read = false;
        self.look(start, at);
    }

    /// Looks for the next start bit. Where the line is low past the frame, the next one begins at the next edge.
    fn look(&mut self, start: Cycles, at: Cycles) {
        self.line.retain(|edge| edge.end > at && edge.start > start);
        self.receiving = self.line.front().map(|edge| edge.start.max(at));
        self.started = false;
        self.idle_at = if self.receiving.is_some() { NEVER } else { at + self.frame() };
    }

    /// Brings the next frame to the line at `at`.
    fn send(&mut self, at: Cycles) {
        if bit(self.cr1, UE)
            && bit(self.cr1, TE)
            && self.sending.is_none()
            && let Some(value) = self.waiting.take()
        {
            let start = at.max(self.ready);
            self.sending = Some(Frame { start, end: start + self.frame(), value });
            self.sr |= TXE;
        }
    }

    fn sampled_at(&self) -> Cycles {
        let half_bits = if self.started { STOP_BIT } else { START_BIT };
        self.receiving.map_or(NEVER, |start| start + half_bits * self.half_bit())
    }

    fn sent_at(&self) -> Cycles {
        self.sending.map_or(NEVER, |frame| frame.end)
    }
}

impl Peripheral for Usart {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            SR => {
                self.status_read = true;
                self.completion_read = self.sr & TC != 0;
                Ok(self.sr)
            }
            DR => {
                if self.status_read {
                    self.sr &= !BY_READING;
                }
                self.sr &= !RXNE;
                Ok(self.received.into())
            }
            BRR => Ok(self.brr),
            CR1 => Ok(self.cr1),
            CR2 => Ok(self.cr2),
            CR3 => Ok(self.cr3),
            GTPR => Ok(self.gtpr),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            // RXNE and TC can be cleared by writing zero.
            SR => self.sr &= value | !(RXNE | TC),
            DR => {
                if std::mem::take(&mut self.completion_read) {
                    self.sr &= !TC;
                }
                self.waiting = Some(value as u8);
                self.sr &= !TXE;
                self.send(self.now);
            }
            BRR => self.brr = value & 0xFFFF,
            CR1 if value & CR1_REFUSED != 0 => {
                return Err(Refusal::Use("breaks, mute mode, parity and nine bits are not modelled"));
            }
            CR1 => {
                if value & !self.cr1 & (1 << TE) != 0 {
                    self.ready = self.now + self.frame();
                }
                self.cr1 = value;
                if !bit(value, UE) || !bit(value, RE) {
                    self.line.clear();
                    self.receiving = None;
                    self.started = false;
                    self.idle_at = NEVER;
                }
                self.send(self.now);
            }
            CR2 if value & 0x4FE0 != 0 || bit(value, 12) => {
                return Err(Refusal::Use("LIN, the synchronous mode and half stop bits are not modelled"));
            }
            CR2 => self.cr2 = value,
            CR3 if value & CR3_REFUSED != 0 => {
                return Err(Refusal::Use("infrared, half duplex, smart cards and flow control are not modelled"));
            }
            CR3 => self.cr3 = value,
            GTPR => self.gtpr = value,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
        while let (Some(start), at) = (self.receiving, self.sampled_at())
            && at <= to
        {
            self.sample(start, at);
        }
        if self.idle_at <= to {
            self.idle_at = NEVER;
            self.sr |= IDLE;
            self.status_read = false;
        }
        if let Some(frame) = self.sending
            && frame.end <= to
        {
            self.sending = None;
            self.sent = Some(frame);
            self.send(frame.end);
            if self.sending.is_none() {
                self.sr |= TC;
            }
        }
    }

    fn next_event(&self) -> Cycles {
        self.sampled_at().min(self.sent_at()).min(self.idle_at)
    }

    fn interrupts(&self) -> u32 {
        let on = |enable: u32, flags: u32| bit(self.cr1, enable) && self.sr & flags != 0;
        let error = bit(self.cr3, EIE) && bit(self.cr3, DMAR) && self.sr & (FE | NF | ORE) != 0;
        u32::from(on(RXNEIE, RXNE | ORE) || on(IDLEIE, IDLE) || on(TXEIE, TXE) || on(TCIE, TC) || error)
    }

    fn requests(&self) -> Requests {
        Requests {
            receive: bit(self.cr3, DMAR) && self.sr & RXNE != 0,
            transmit: bit(self.cr3, DMAT) && self.sr & TXE != 0 && bit(self.cr1, TE),
        }
    }

    fn set_divider(&mut self, divider: Cycles) {
        self.divider = divider;
    }

    fn reset(&mut self) {
        *self = Self { now: self.now, divider: self.divider, ..Self::new() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIT: Cycles = 1_000;

    /// Enabled both ways, with 1 000 core cycles a bit.
    fn port() -> Usart {
        let mut usart = Usart::new();
        usart.set_divider(4);
        usart.write(BRR, 250).unwrap();
        usart.write(CR1, 1 << UE | 1 << RE | 1 << TE | 1 << RXNEIE).unwrap();
        usart
    }

    fn byte(start: Cycles, value: u8, length: Cycles) -> Edge {
        Edge { start, end: start + 10 * length, levels: u128::from(value) << 1 | 1 << 9, bits: 10 }
    }

    #[test]
    fn a_byte_is_there_in_the_middle_of_its_stop_bit_and_the_line_idle_a_frame_later() {
        let mut usart = port();
        usart.receive(byte(0, 0x53, BIT));
        assert_eq!(usart.next_event(), 500);
        usart.advance(500);
        assert_eq!(usart.next_event(), 9_500);
        usart.advance(9_500);
        assert_eq!((usart.read(SR), usart.interrupts()), (Ok(TXE | TC | RXNE), 1));
        assert_eq!(usart.read(DR), Ok(0x53));
        assert_eq!((usart.interrupts(), usart.next_event()), (0, 19_500));
        usart.advance(19_500);
        assert_eq!(usart.read(SR), Ok(TXE | TC | IDLE));
        usart.read(DR).unwrap();
        assert_eq!(usart.read(SR), Ok(TXE | TC));
    }

    #[test]
    fn bytes_that_are_not_fetched_are_lost() {
        let mut usart = port();
        usart.receive(byte(0, 1, BIT));
        usart.advance(9_900);
        usart.receive(byte(10_000, 2, BIT));
        usart.advance(30_000);
        assert_eq!(usart.read(SR).unwrap() & (RXNE | ORE), RXNE | ORE);
        assert_eq!(usart.read(DR), Ok(1));
        assert_eq!(usart.read(SR).unwrap() & (RXNE | ORE), 0);
    }

    #[test]
    fn slightly_wrong_rates_are_understood_and_very_wrong_ones_are_not() {
        for (length, value) in [(970, Some(0x96)), (1_030, Some(0x96)), (500, None)] {
            let mut usart = port();
            usart.receive(byte(0, 0x96, length));
            usart.advance(9_500);
            let status = usart.read(SR).unwrap();
            let read = usart.read(DR).unwrap();
            assert_eq!(value, (status & FE == 0 && read == 0x96).then_some(0x96));
        }
    }

    #[test]
    fn a_break_is_a_framing_error() {
        let mut usart = port();
        usart.receive(Edge { start: 0, end: 13 * BIT, levels: 0, bits: 13 });
        usart.advance(9_500);
        assert_eq!((usart.read(SR).unwrap() & (RXNE | FE), usart.read(DR)), (RXNE | FE, Ok(0)));
    }

    /// Twelve levels a bit, so that the three samples of a bit can differ; `spikes` are inverted.
    fn noisy(value: u8, spikes: u128) -> Edge {
        let bits = u32::from(value) << 1 | 1 << 9;
        let levels = (0..120).fold(0, |levels, n| levels | u128::from(bits >> (n / 12) & 1) << n);
        Edge { start: 0, end: 10 * BIT, levels: levels ^ spikes, bits: 120 }
    }

    #[test]
    fn two_of_three_samples_decide_and_noise_is_told() {
        // In bit 3 of the data: the first sample of it, two of them, between two bits.
        for (spikes, status, value) in
            [(0, 0, 0x53), (1 << (4 * 12 + 5), NF, 0x53), (3 << (4 * 12 + 5), 0, 0x5B), (1 << (4 * 12), 0, 0x53)]
        {
            let mut usart = port();
            usart.receive(noisy(0x53, spikes));
            usart.advance(9_500);
            assert_eq!((usart.read(SR).unwrap() & (NF | FE), usart.read(DR)), (status, Ok(value)), "{spikes:x}");
            assert_eq!(usart.read(SR).unwrap() & NF, 0);
        }
    }

    #[test]
    fn a_spike_is_no_start_bit() {
        let mut usart = port();
        usart.receive(Edge { start: 0, end: BIT / 4, levels: 0, bits: 1 });
        usart.advance(BIT);
        usart.receive(byte(2 * BIT, 0x53, BIT));
        usart.advance(2 * BIT + 9_500);
        assert_eq!((usart.read(SR).unwrap() & (RXNE | NF | FE), usart.read(DR)), (RXNE, Ok(0x53)));
    }

    #[test]
    fn frames_follow_each_other_and_the_last_one_is_told() {
        let mut usart = port();
        // The transmitter begins with an idle frame.
        assert_eq!(usart.read(SR), Ok(TXE | TC));
        usart.write(DR, 1).unwrap();
        usart.write(DR, 2).unwrap();
        assert_eq!((usart.read(SR), usart.next_event()), (Ok(0), 20_000));
        usart.advance(20_000);
        assert_eq!(usart.take_sent(), Some(Frame { start: 10_000, end: 20_000, value: 1 }));
        assert_eq!(usart.read(SR), Ok(TXE));
        usart.advance(30_000);
        assert_eq!(usart.take_sent(), Some(Frame { start: 20_000, end: 30_000, value: 2 }));
        // Whoever has not seen that it was the last one does not clear the flag by the next.
        usart.write(DR, 3).unwrap();
        assert_eq!(usart.read(SR), Ok(TXE | TC));
    }
}
