//! DMA: a controller with eight streams (RM0090 10.5), in direct mode or with its FIFO, which is not seen from
//! outside. Memory to memory and double buffers are refused.
//!
//! The controller does not move data itself: its owner looks for streams whose requests are active
//! ([`Dma::items`]) and moves an item with [`Dma::step`].

use super::peripheral::{Access, Peripheral, Refusal, bit, field};
use super::unit::PeripheralName;

const LISR: u32 = 0x00;
const HISR: u32 = 0x04;
const LIFCR: u32 = 0x08;
const HIFCR: u32 = 0x0C;
const STREAMS: core::ops::Range<u32> = 0x10..0xD0;
const STREAM_SIZE: u32 = 0x18;
const CR: u32 = 0x00;
const NDTR: u32 = 0x04;
const PAR: u32 = 0x08;
const M0AR: u32 = 0x0C;
const M1AR: u32 = 0x10;
const FCR: u32 = 0x14;

const EN: u32 = 0;
const CIRC: u32 = 8;
const MINC: u32 = 10;
/// PFCTRL, PINC, PINCOS, DBM, CT.
const CR_REFUSED: u32 = 1 << 5 | 1 << 9 | 1 << 15 | 1 << 18 | 1 << 19;
const FCR_RESET: u32 = 0x21;

/// Flags of a stream: half and complete. The bits that enable their interrupts follow the same order in CR.
const HTIF: u32 = 1 << 4;
const TCIF: u32 = 1 << 5;
const HTIE: u32 = 3;
const TCIE: u32 = 4;
/// Where the flags of streams 0 to 3, and 4 to 7, begin in their register.
const PLACES: [u32; 4] = [0, 6, 16, 22];

/// The peripherals that ask for data at a stream (tables 42 and 43), by controller, stream and channel; true is towards
/// the peripheral. The peripherals that are not modelled are not among them.
const REQUESTS: [(usize, usize, u32, PeripheralName, bool); 20] = [
    (0, 0, 0, PeripheralName::Spi3, false),
    (0, 2, 0, PeripheralName::Spi3, false),
    (0, 5, 0, PeripheralName::Spi3, true),
    (0, 7, 0, PeripheralName::Spi3, true),
    (0, 3, 0, PeripheralName::Spi2, false),
    (0, 4, 0, PeripheralName::Spi2, true),
    (0, 1, 4, PeripheralName::Usart3, false),
    (0, 3, 4, PeripheralName::Usart3, true),
    (0, 4, 7, PeripheralName::Usart3, true),
    (0, 5, 4, PeripheralName::Usart2, false),
    (0, 6, 4, PeripheralName::Usart2, true),
    (1, 0, 0, PeripheralName::Adc1, false),
    (1, 4, 0, PeripheralName::Adc1, false),
    (1, 0, 3, PeripheralName::Spi1, false),
    (1, 2, 3, PeripheralName::Spi1, false),
    (1, 3, 3, PeripheralName::Spi1, true),
    (1, 5, 3, PeripheralName::Spi1, true),
    (1, 2, 4, PeripheralName::Usart1, false),
    (1, 5, 4, PeripheralName::Usart1, false),
    (1, 7, 4, PeripheralName::Usart1, true),
];

/// A stream.
#[derive(Clone, Copy, Debug)]
struct Stream {
    cr: u32,
    ndtr: u32,
    par: u32,
    m0ar: u32,
    m1ar: u32,
    fcr: u32,
    flags: u32,
    /// Items of a whole transfer, as NDTR said when the stream was enabled.
    items: u32,
}

impl Stream {
    const RESET: Self = Self { cr: 0, ndtr: 0, par: 0, m0ar: 0, m1ar: 0, fcr: FCR_RESET, flags: 0, items: 0 };

    fn interrupts(&self) -> bool {
        let on = |enable: u32, flag: u32| bit(self.cr, enable) && self.flags & flag != 0;
        on(HTIE, HTIF) || on(TCIE, TCIF)
    }
}

/// An item to be moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Item {
    /// The stream it belongs to.
    pub(super) stream: usize,
    /// The peripheral that asks for it.
    pub(super) unit: PeripheralName,
    /// Whether it goes to the peripheral.
    pub(super) transmit: bool,
    /// Address of the data register.
    pub(super) register: u32,
    /// Address in memory.
    pub(super) memory: u32,
    /// Bytes of the item in memory: 1, 2 or 4.
    pub(super) bytes: usize,
}

/// A controller.
#[derive(Debug)]
pub(super) struct Dma {
    index: usize,
    streams: [Stream; 8],
}

impl Dma {
    /// Controller DMA1 (0) or DMA2 (1).
    pub(super) fn new(index: usize) -> Self {
        Self { index, streams: [Stream::RESET; 8] }
    }

    /// The items that enabled streams would move next, if they are asked.
    pub(super) fn items(&self) -> impl Iterator<Item = Item> {
        self.streams.iter().enumerate().filter(|(_, stream)| bit(stream.cr, EN)).filter_map(|(index, stream)| {
            let bytes = 1 << field(stream.cr, 13, 2);
            let done = if bit(stream.cr, MINC) { stream.items - stream.ndtr } else { 0 };
            let (unit, transmit) = self.request(index, stream.cr)?;
            let memory = stream.m0ar + done * bytes;
            Some(Item { stream: index, unit, transmit, register: stream.par, memory, bytes: bytes as usize })
        })
    }

    /// The stream has moved an item.
    pub(super) fn step(&mut self, index: usize) {
        let Some(stream) = self.streams.get_mut(index) else { return };
        stream.ndtr -= 1;
        if stream.ndtr == stream.items / 2 {
            stream.flags |= HTIF;
        }
        if stream.ndtr == 0 {
            stream.flags |= TCIF;
            if bit(stream.cr, CIRC) {
                stream.ndtr = stream.items;
            } else {
                stream.cr &= !(1 << EN);
            }
        }
    }

    /// Finds the peripheral that asks for data at stream `index` with these settings, if the direction is right.
    fn request(&self, index: usize, cr: u32) -> Option<(PeripheralName, bool)> {
        let (channel, transmit) = (field(cr, 25, 3), field(cr, 6, 2) == 1);
        let entry = (self.index, index, channel);
        REQUESTS
            .iter()
            .find(|(controller, stream, line, ..)| (*controller, *stream, *line) == entry)
            .filter(|(.., towards)| *towards == transmit)
            .map(|&(.., unit, towards)| (unit, towards))
    }

    fn write_stream(&mut self, index: usize, register: u32, value: u32) -> Access {
        let enabled = self.streams.get(index).is_some_and(|stream| bit(stream.cr, EN));
        let known = self.request(index, value).is_some();
        let stream = self.streams.get_mut(index).ok_or(Refusal::Register)?;
        match register {
            CR if bit(value, EN) && !enabled => {
                if value & CR_REFUSED != 0 || field(value, 6, 2) > 1 {
                    return Err(Refusal::Use("only between one register and memory, into one buffer, is modelled"));
                }
                if field(value, 11, 2) != field(value, 13, 2) {
                    return Err(Refusal::Use("packing is not modelled"));
                }
                if !known {
                    return Err(Refusal::Use("nothing modelled asks for data at this stream, channel and direction"));
                }
                if stream.ndtr == 0 {
                    return Err(Refusal::Use("nothing to transfer"));
                }
                stream.items = stream.ndtr;
                stream.cr = value;
            }
            CR => {
                // Ended before its time, a stream says so with the flag of the end.
                if enabled && !bit(value, EN) {
                    stream.flags |= TCIF;
                }
                stream.cr = value;
            }
            NDTR | PAR if enabled => return Err(Refusal::Use("changed while the stream is enabled")),
            NDTR => stream.ndtr = value & 0xFFFF,
            PAR => stream.par = value,
            M0AR => stream.m0ar = value,
            M1AR => stream.m1ar = value,
            FCR => stream.fcr = value & 0x87,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn status(&self, first: usize) -> u32 {
        let streams = self.streams.iter().skip(first);
        streams.zip(PLACES).fold(0, |status, (stream, place)| status | stream.flags << place)
    }

    fn clear(&mut self, first: usize, value: u32) {
        for (stream, place) in self.streams.iter_mut().skip(first).zip(PLACES) {
            stream.flags &= !(value >> place & 0x3D);
        }
    }
}

impl Peripheral for Dma {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            LISR => return Ok(self.status(0)),
            HISR => return Ok(self.status(4)),
            LIFCR | HIFCR => return Ok(0),
            _ if !STREAMS.contains(&offset) => return Err(Refusal::Register),
            _ => {}
        }
        let (index, register) = ((offset - STREAMS.start) / STREAM_SIZE, (offset - STREAMS.start) % STREAM_SIZE);
        let stream = self.streams.get(index as usize).ok_or(Refusal::Register)?;
        match register {
            CR => Ok(stream.cr),
            NDTR => Ok(stream.ndtr),
            PAR => Ok(stream.par),
            M0AR => Ok(stream.m0ar),
            M1AR => Ok(stream.m1ar),
            FCR => Ok(stream.fcr),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            LIFCR => self.clear(0, value),
            HIFCR => self.clear(4, value),
            _ if STREAMS.contains(&offset) => {
                let (index, register) =
                    ((offset - STREAMS.start) / STREAM_SIZE, (offset - STREAMS.start) % STREAM_SIZE);
                self.write_stream(index as usize, register, value)?;
            }
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn interrupts(&self) -> u32 {
        self.streams.iter().rev().fold(0, |lines, stream| lines << 1 | u32::from(stream.interrupts()))
    }

    fn reset(&mut self) {
        self.streams = [Stream::RESET; 8];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(index: u32, register: u32) -> u32 {
        STREAMS.start + index * STREAM_SIZE + register
    }

    /// Channel 4, memory increment, from the peripheral, interrupts at half and end.
    const SETTINGS: u32 = 4 << 25 | 1 << MINC | 1 << HTIE | 1 << TCIE;

    #[test]
    fn a_ring_goes_round() {
        let mut dma = Dma::new(0);
        dma.write(stream(1, NDTR), 4).unwrap();
        dma.write(stream(1, PAR), 0x4000_4804).unwrap();
        dma.write(stream(1, M0AR), 0x2000_0100).unwrap();
        dma.write(stream(1, CR), SETTINGS | 1 << CIRC | 1 << EN).unwrap();
        for round in 0..2 {
            for n in 0..4 {
                let item = dma.items().next().unwrap();
                assert_eq!((item.unit, item.memory, item.bytes), (PeripheralName::Usart3, 0x2000_0100 + n, 1));
                dma.step(1);
                let flags = dma.read(LISR).unwrap() >> 6;
                assert_eq!(flags & HTIF != 0, n >= 1 || round > 0);
                assert_eq!(flags & TCIF != 0, n == 3 || round > 0);
            }
        }
        assert_eq!(dma.interrupts(), 2);
        dma.write(LIFCR, 0x3F << 6).unwrap();
        assert_eq!(dma.interrupts(), 0);
    }

    #[test]
    fn the_channel_must_be_that_of_the_request() {
        let mut dma = Dma::new(0);
        dma.write(stream(1, NDTR), 4).unwrap();
        for settings in [SETTINGS ^ 1 << 25, SETTINGS | 1 << 6] {
            assert!(dma.write(stream(1, CR), settings | 1 << EN).is_err());
        }
        dma.write(stream(1, CR), SETTINGS | 1 << EN).unwrap();
    }
}
