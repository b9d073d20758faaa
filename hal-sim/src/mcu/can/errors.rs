//! The error counters of the controller (RM0090 32.7.6).

/// Bits of the error status register: a counter is at its warning limit, is passive, the controller is bus-off.
pub(super) const EWGF: u32 = 1;
pub(super) const EPVF: u32 = 1 << 1;
pub(super) const BOFF: u32 = 1 << 2;

/// Errors so far.
#[derive(Debug, Default)]
pub(super) struct Errors {
    /// Code of the last error.
    pub(super) last: u32,
    /// Counters of the transmitter and the receiver.
    transmit: u32,
    receive: u32,
    /// The controller is off the bus.
    pub(super) bus_off: bool,
}

impl Errors {
    /// A frame of the controller has gone out.
    pub(super) fn sent(&mut self) {
        self.transmit = self.transmit.saturating_sub(1);
        self.last = 0;
    }

    /// A frame has come in.
    pub(super) fn received(&mut self) {
        self.receive = self.receive.saturating_sub(1);
        self.last = 0;
    }

    /// A frame could not be sent.
    pub(super) fn count_transmit(&mut self) {
        self.transmit += 8;
        self.bus_off |= self.transmit > 255;
    }

    /// A frame could not be received.
    pub(super) fn count_receive(&mut self) {
        self.receive = (self.receive + 1).min(128);
    }

    /// Whether the transmitter is error passive.
    pub(super) fn is_transmitter_passive(&self) -> bool {
        self.transmit > 127
    }

    /// Whether a counter is at its warning limit.
    pub(super) fn is_warning(&self) -> bool {
        self.transmit >= 96 || self.receive >= 96
    }

    /// Whether a counter is error passive.
    pub(super) fn is_passive(&self) -> bool {
        self.transmit > 127 || self.receive > 127
    }

    /// The controller is back on the bus.
    pub(super) fn recover(&mut self) {
        *self = Self { last: self.last, ..Self::default() };
    }

    /// The error status register.
    pub(super) fn status(&self) -> u32 {
        let flag = |on: bool, mask: u32| if on { mask } else { 0 };
        let flags = flag(self.is_warning(), EWGF) | flag(self.is_passive(), EPVF) | flag(self.bus_off, BOFF);
        flags | self.last << 4 | self.transmit.min(255) << 16 | self.receive << 24
    }
}
