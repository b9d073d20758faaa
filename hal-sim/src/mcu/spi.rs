//! SPI: the serial peripheral interface as a master (RM0090 28.5), full duplex, 8 or 16 bits.

use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal, Requests, bit, field};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0C;
const CRCPR: u32 = 0x10;
const I2SCFGR: u32 = 0x1C;

const CPHA: u32 = 0;
const CPOL: u32 = 1;
const MSTR: u32 = 2;
const SPE: u32 = 6;
const SSI: u32 = 8;
const SSM: u32 = 9;
const DFF: u32 = 11;
/// LSBFIRST, RXONLY, CRCNEXT, CRCEN, BIDIOE, BIDIMODE.
const CR1_REFUSED: u32 = 1 << 7 | 0xF << 12 | 1 << 10;

const RXDMAEN: u32 = 0;
const TXDMAEN: u32 = 1;
const ERRIE: u32 = 5;
const RXNEIE: u32 = 6;
const TXEIE: u32 = 7;

const RXNE: u32 = 1;
const TXE: u32 = 1 << 1;
const OVR: u32 = 1 << 6;
const BSY: u32 = 1 << 7;

/// A word that has been clocked out; its sender wants to know what came in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Word {
    /// The word that was sent.
    pub(super) mosi: u16,
    /// Whether it has 16 bits.
    pub(super) wide: bool,
    /// The time that a bit took.
    pub(super) bit: Cycles,
    /// When its last bit was sampled.
    pub(super) at: Cycles,
}

/// A port.
#[derive(Debug)]
pub(super) struct Spi {
    now: Cycles,
    divider: Cycles,
    cr1: u32,
    cr2: u32,
    sr: u32,
    /// The receive buffer.
    received: u16,
    /// The transmit buffer.
    waiting: Option<u16>,
    /// The word on the wire, and when it ends.
    shifting: Option<(u16, Cycles)>,
    /// The word that has just ended.
    done: Option<Word>,
    /// SR has been read while OVR was set and DR before: reading clears it.
    data_read: bool,
}

impl Spi {
    pub(super) fn new() -> Self {
        Self {
            now: 0,
            divider: 1,
            cr1: 0,
            cr2: 0,
            sr: TXE,
            received: 0,
            waiting: None,
            shifting: None,
            done: None,
            data_read: false,
        }
    }

    /// The clock's mode, 0..=3.
    pub(super) fn mode(&self) -> u32 {
        field(self.cr1, CPHA, 1) | field(self.cr1, CPOL, 1) << 1
    }

    /// The word that has ended, to be answered by [`complete`](Self::complete).
    pub(super) fn take_done(&mut self) -> Option<Word> {
        self.done.take()
    }

    /// Whether a word is on the wire.
    pub(super) fn is_shifting(&self) -> bool {
        self.shifting.is_some()
    }

    /// Takes what came in during the word that has ended.
    pub(super) fn complete(&mut self, miso: u16) {
        if self.sr & RXNE != 0 {
            self.sr |= OVR;
        } else {
            self.received = miso;
            self.sr |= RXNE;
        }
        self.data_read = false;
    }

    /// Core cycles of a bit on the wire.
    fn bit(&self) -> Cycles {
        self.divider << (field(self.cr1, 3, 3) + 1)
    }

    /// Core cycles of a word.
    fn word(&self) -> Cycles {
        let bits = if bit(self.cr1, DFF) { 16 } else { 8 };
        bits * self.bit()
    }

    /// Brings the next word to the wire at `at`.
    fn shift(&mut self, at: Cycles) {
        if bit(self.cr1, SPE)
            && self.shifting.is_none()
            && let Some(word) = self.waiting.take()
        {
            self.shifting = Some((word, at + self.word()));
            self.sr |= TXE;
        }
    }

    fn busy(&self) -> u32 {
        if self.shifting.is_some() || self.waiting.is_some() { BSY } else { 0 }
    }
}

impl Word {
    /// When its first bit began.
    pub(super) fn start(self) -> Cycles {
        self.at - self.bit * if self.wide { 16 } else { 8 }
    }
}

impl Peripheral for Spi {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            CR1 => Ok(self.cr1),
            CR2 => Ok(self.cr2),
            SR => {
                let status = self.sr | self.busy();
                // OVR is cleared by reading DR, then SR.
                if self.data_read {
                    self.sr &= !OVR;
                }
                Ok(status)
            }
            DR => {
                self.sr &= !RXNE;
                self.data_read = true;
                Ok(self.received.into())
            }
            CRCPR => Ok(7),
            I2SCFGR => Ok(0),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            CR1 if value & CR1_REFUSED != 0 => {
                return Err(Refusal::Use("only full duplex, most significant bit first, without CRC is modelled"));
            }
            CR1 if bit(value, SPE) && (!bit(value, MSTR) || bit(value, SSM) && !bit(value, SSI)) => {
                return Err(Refusal::Use("only the master is modelled"));
            }
            CR1 if self.shifting.is_some() => return Err(Refusal::Use("changed during a transfer")),
            CR1 => {
                self.cr1 = value;
                self.shift(self.now);
            }
            CR2 if value & 0x18 != 0 => return Err(Refusal::Use("reserved bits of CR2")),
            CR2 => self.cr2 = value,
            SR => {}
            DR => {
                self.waiting = Some(value as u16);
                self.sr &= !TXE;
                self.shift(self.now);
            }
            CRCPR => {}
            I2SCFGR if value & 1 << 11 == 0 => {}
            I2SCFGR => return Err(Refusal::Use("audio is not modelled")),
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
        if let Some((mosi, at)) = self.shifting
            && at <= to
        {
            self.shifting = None;
            self.done = Some(Word { mosi, wide: bit(self.cr1, DFF), bit: self.bit(), at });
            self.shift(at);
        }
    }

    fn next_event(&self) -> Cycles {
        self.shifting.map_or(NEVER, |(_, at)| at)
    }

    fn interrupts(&self) -> u32 {
        let enabled = bit(self.cr2, RXNEIE) && self.sr & RXNE != 0
            || bit(self.cr2, TXEIE) && self.sr & TXE != 0
            || bit(self.cr2, ERRIE) && self.sr & OVR != 0;
        u32::from(enabled)
    }

    fn requests(&self) -> Requests {
        Requests {
            receive: bit(self.cr2, RXDMAEN) && self.sr & RXNE != 0,
            transmit: bit(self.cr2, TXDMAEN) && self.sr & TXE != 0 && bit(self.cr1, SPE),
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

    /// Mode 3, 8 bits, bus clock / 64, enabled.
    const SETTINGS: u32 = 3 | 1 << MSTR | 5 << 3 | 1 << SPE | 1 << SSI | 1 << SSM;

    fn port() -> Spi {
        let mut spi = Spi::new();
        spi.set_divider(2);
        spi.write(CR2, 1 << 2).unwrap();
        spi.write(CR1, SETTINGS).unwrap();
        spi
    }

    #[test]
    fn bytes_take_their_time_on_the_wire_and_follow_without_a_gap() {
        let mut spi = port();
        spi.write(DR, 0x12).unwrap();
        assert_eq!(spi.read(SR), Ok(TXE | BSY));
        spi.write(DR, 0x34).unwrap();
        assert_eq!(spi.read(SR), Ok(BSY));
        assert_eq!(spi.next_event(), 8 * 128);
        spi.advance(1_030);
        assert_eq!(spi.take_done(), Some(Word { mosi: 0x12, wide: false, bit: 128, at: 1_024 }));
        spi.complete(0xA5);
        assert_eq!((spi.read(SR), spi.next_event()), (Ok(TXE | BSY | RXNE), 2_048));
        assert_eq!(spi.read(DR), Ok(0xA5));
        spi.advance(2_048);
        spi.complete(0x5A);
        assert_eq!((spi.read(SR), spi.mode()), (Ok(TXE | RXNE), 3));
    }

    #[test]
    fn what_is_not_fetched_is_kept_and_the_next_is_lost() {
        let mut spi = port();
        spi.complete(1);
        spi.complete(2);
        assert_eq!(spi.read(SR), Ok(TXE | RXNE | OVR));
        assert_eq!(spi.read(DR), Ok(1));
        assert_eq!((spi.read(SR), spi.read(SR)), (Ok(TXE | OVR), Ok(TXE)));
    }
}
