//! ADC1 with the registers common to all converters (RM0090 13.13): the regular sequence, started by software,
//! single or continuous, fetched by DMA or by the program. Injected channels, triggers and the analog watchdog are
//! refused. DMA is always asked, as with DDS set.

use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal, Requests, bit, field};

const SR: u32 = 0x00;
const CR1: u32 = 0x04;
const CR2: u32 = 0x08;
const SMPR1: u32 = 0x0C;
const SMPR2: u32 = 0x10;
const SQR1: u32 = 0x2C;
const SQR2: u32 = 0x30;
const SQR3: u32 = 0x34;
const DR: u32 = 0x4C;
const CSR: u32 = 0x300;
const CCR: u32 = 0x304;

const EOC: u32 = 1 << 1;
const STRT: u32 = 1 << 4;
const OVR: u32 = 1 << 5;

const EOCIE: u32 = 5;
const SCAN: u32 = 8;
const OVRIE: u32 = 26;
/// EOCIE, SCAN, OVRIE; 12 bits.
const CR1_MODELLED: u32 = 1 << EOCIE | 1 << SCAN | 1 << OVRIE;

const ADON: u32 = 0;
const CONT: u32 = 1;
const DMA: u32 = 8;
const DDS: u32 = 9;
const EOCS: u32 = 10;
const SWSTART: u32 = 30;
const CR2_MODELLED: u32 = 1 << ADON | 1 << CONT | 1 << DMA | 1 << DDS | 1 << EOCS | 1 << SWSTART;

/// Clocks of sampling, by the setting of a channel, and those of the conversion itself.
const SAMPLING: [Cycles; 8] = [3, 15, 28, 56, 84, 112, 144, 480];
const CONVERSION: Cycles = 12;

/// The converter.
#[derive(Debug)]
pub(super) struct Adc {
    now: Cycles,
    divider: Cycles,
    sr: u32,
    cr1: u32,
    cr2: u32,
    smpr: [u32; 2],
    sqr: [u32; 3],
    ccr: u32,
    data: u16,
    /// Place in the sequence of the conversion under way, and when it ends.
    converting: Option<(u32, Cycles)>,
    /// The channel whose conversion has just ended.
    done: Option<u32>,
}

impl Adc {
    pub(super) fn new() -> Self {
        Self {
            now: 0,
            divider: 1,
            sr: 0,
            cr1: 0,
            cr2: 0,
            smpr: [0; 2],
            sqr: [0; 3],
            ccr: 0,
            data: 0,
            converting: None,
            done: None,
        }
    }

    /// The channel (0..=18) whose conversion has ended, to be answered by [`complete`](Self::complete).
    pub(super) fn take_done(&mut self) -> Option<u32> {
        self.done.take()
    }

    /// The result of the conversion that has ended, 12 bits.
    pub(super) fn complete(&mut self, value: u16) {
        let watched = bit(self.cr2, DMA) || bit(self.cr2, EOCS);
        if watched && self.sr & EOC != 0 {
            self.sr |= OVR;
            self.converting = None;
            return;
        }
        self.data = value;
        // Without DMA and EOCS, EOC tells of the end of the sequence only; the last value is what can be read.
        if watched || self.converting.is_none_or(|(place, _)| place == 0) {
            self.sr |= EOC;
        }
    }

    /// Whether the temperature sensor and the reference can be converted.
    pub(super) fn inner_channels(&self) -> bool {
        bit(self.ccr, 23)
    }

    fn channel(&self, place: u32) -> u32 {
        let register = match place {
            0..6 => self.sqr[2],
            6..12 => self.sqr[1],
            _ => self.sqr[0],
        };
        field(register, 5 * (place % 6), 5)
    }

    fn last_place(&self) -> u32 {
        if bit(self.cr1, SCAN) { field(self.sqr[0], 20, 4) } else { 0 }
    }

    /// Core cycles of one clock of the converter.
    fn clock(&self) -> Cycles {
        self.divider * Cycles::from(2 * (field(self.ccr, 16, 2) + 1))
    }

    /// Core cycles for which a channel is sampled.
    pub(super) fn sampling(&self, channel: u32) -> Cycles {
        let setting =
            if channel < 10 { field(self.smpr[1], 3 * channel, 3) } else { field(self.smpr[0], 3 * (channel - 10), 3) };
        SAMPLING.get(setting as usize).copied().unwrap_or(0) * self.clock()
    }

    fn start(&mut self, place: u32, at: Cycles) {
        let time = self.sampling(self.channel(place)) + CONVERSION * self.clock();
        self.converting = Some((place, at + time));
    }
}

impl Peripheral for Adc {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            SR => Ok(self.sr),
            CR1 => Ok(self.cr1),
            CR2 => Ok(self.cr2),
            SMPR1 => Ok(self.smpr[0]),
            SMPR2 => Ok(self.smpr[1]),
            SQR1 => Ok(self.sqr[0]),
            SQR2 => Ok(self.sqr[1]),
            SQR3 => Ok(self.sqr[2]),
            DR => {
                self.sr &= !EOC;
                Ok(self.data.into())
            }
            CSR => Ok(self.sr),
            CCR => Ok(self.ccr),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            SR => self.sr &= value,
            CR1 if value & !CR1_MODELLED != 0 => {
                return Err(Refusal::Use("only EOCIE, SCAN and OVRIE of CR1 are modelled"));
            }
            CR1 => self.cr1 = value,
            CR2 if value & !CR2_MODELLED != 0 => {
                return Err(Refusal::Use("only conversions started by software are modelled"));
            }
            CR2 => {
                self.cr2 = value & !(1 << SWSTART);
                if !bit(value, ADON) {
                    self.converting = None;
                } else if bit(value, SWSTART) {
                    self.sr |= STRT;
                    self.start(0, self.now);
                }
            }
            SMPR1 => self.smpr[0] = value,
            SMPR2 => self.smpr[1] = value,
            SQR1 => self.sqr[0] = value,
            SQR2 => self.sqr[1] = value,
            SQR3 => self.sqr[2] = value,
            CCR if value & 0xDF1F != 0 => return Err(Refusal::Use("several converters together are not modelled")),
            CCR => self.ccr = value,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
        let Some((place, at)) = self.converting.filter(|(_, at)| *at <= to) else { return };
        self.done = Some(self.channel(place));
        self.converting = None;
        if place < self.last_place() {
            self.start(place + 1, at);
        } else if bit(self.cr2, CONT) {
            self.start(0, at);
        }
    }

    fn next_event(&self) -> Cycles {
        self.converting.map_or(NEVER, |(_, at)| at)
    }

    fn interrupts(&self) -> u32 {
        u32::from(bit(self.cr1, EOCIE) && self.sr & EOC != 0 || bit(self.cr1, OVRIE) && self.sr & OVR != 0)
    }

    fn requests(&self) -> Requests {
        Requests { receive: bit(self.cr2, DMA) && self.sr & EOC != 0 && self.sr & OVR == 0, transmit: false }
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

    #[test]
    fn a_sequence_is_converted_in_order_and_in_time() {
        let mut adc = Adc::new();
        adc.set_divider(2);
        adc.write(CCR, 1 << 16).unwrap();
        adc.write(SMPR1, 7).unwrap();
        adc.write(SQR1, 1 << 20).unwrap();
        adc.write(SQR3, 10 | 3 << 5).unwrap();
        adc.write(CR1, 1 << SCAN).unwrap();
        adc.write(CR2, 1 << ADON | 1 << CONT | 1 << DMA | 1 << DDS | 1 << SWSTART).unwrap();
        // 84 MHz / 4: 492 clocks of eight core cycles for channel 10, 15 for channel 3.
        for (at, channel) in [(3_936, 10), (4_056, 3), (7_992, 10)] {
            assert_eq!(adc.next_event(), at);
            adc.advance(at);
            assert_eq!(adc.take_done(), Some(channel));
            assert_eq!(adc.sampling(channel), if channel == 10 { 480 * 8 } else { 3 * 8 });
            adc.complete(channel as u16 * 100);
            assert!(adc.requests().receive);
            assert_eq!(adc.read(DR), Ok(channel * 100));
        }
        adc.advance(8_112);
        adc.complete(1);
        adc.complete(2);
        assert_eq!((adc.read(SR).unwrap() & OVR, adc.read(DR)), (OVR, Ok(1)));
    }
}
