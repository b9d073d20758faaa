//! The bus of the motion chips, SPI1, on which each chip has its own clock.
//!
//! Words are exchanged at the port's registers, which is faster than Embassy's driver. A datagram of the TMC429 goes
//! out with each request that needs a reading, and in each poll. Its four bytes are two words of 16 bits, one after the
//! other. Those of the other chips go out byte by byte.

use core::convert::Infallible;

use cortex_m::asm;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Output};
use embassy_stm32::pac::SPI1;
use embassy_stm32::pac::spi::vals::{Br, Dff};
use embassy_stm32::peripherals;
use embassy_stm32::spi::{MisoPin, MosiPin, SckPin};
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};

use super::{pins, spi};

/// The demands of a kind of chip on the bus.
#[derive(Clone, Copy)]
pub(crate) struct Pace {
    /// The SPI clock, as a division of 84 MHz.
    pub(crate) clock: Br,
    /// Core cycles to wait between chip select and the first edge, in addition to more than 16 that pass anyway.
    pub(crate) setup: u32,
}

/// A datagram of the TMC429.
type Datagram = [u8; 4];

/// The bus of the motion chips, which is set up for mode 3.
pub(crate) struct MotionBus(());

/// A chip on the bus. Only the owner of the firmware uses the chips, so no exchange interrupts another.
pub struct Chip {
    select: Output<'static>,
    pace: &'static Pace,
}

impl MotionBus {
    /// Sets the port up, with the pins of its clock, output and input. From now on it is used at its registers.
    pub(crate) fn new(
        port: Peri<'static, peripherals::SPI1>,
        clock: Peri<'static, impl SckPin<peripherals::SPI1>>,
        output: Peri<'static, impl MosiPin<peripherals::SPI1>>,
        input: Peri<'static, impl MisoPin<peripherals::SPI1>>,
    ) -> Self {
        // Its destructor would switch the port off.
        core::mem::forget(spi::port(port, clock, output, input));
        MotionBus(())
    }

    /// Chips of one kind with their chip selects.
    pub(crate) fn chips<const N: usize>(&self, selects: [Peri<'static, AnyPin>; N], pace: &'static Pace) -> [Chip; N] {
        selects.map(|select| Chip { select: pins::select(select), pace })
    }
}

impl ErrorType for Chip {
    type Error = Infallible;
}

impl SpiDevice for Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let datagram = match operations {
            [Operation::TransferInPlace(bytes)] => <&mut Datagram>::try_from(&mut **bytes).ok(),
            _ => None,
        };
        let &Pace { clock, setup } = self.pace;
        set_up(clock, if datagram.is_some() { Dff::BITS16 } else { Dff::BITS8 });
        self.select.set_low();
        if setup > 0 {
            // Each turn of this delay, of which there is one more than asked for, takes three cycles at least. The
            // subtraction takes one, and the branch two; the last branch is not taken and takes one. So 16 cycles are
            // six turns, 17 cycles.
            asm::delay(setup / 3);
        }
        match datagram {
            Some(datagram) => exchange_datagram(datagram),
            None => operations.iter_mut().for_each(exchange_bytes),
        }
        // The last edge is in the middle of the last bit. The other half of that bit is longer than a chip needs its
        // select low after it. With a TMC429 it has 64 cycles for three of the chip's clocks, with a TMC5160 16 cycles
        // for 10 ns.
        while SPI1.sr().read().bsy() {}
        self.select.set_high();
        Ok(())
    }
}

/// Sets the clock and the width of a word, if they are others than for the transaction before. They can be changed
/// while the port is off.
fn set_up(clock: Br, width: Dff) {
    let control = SPI1.cr1().read();
    if control.br() != clock || control.dff() != width {
        SPI1.cr1().modify(|w| w.set_spe(false));
        SPI1.cr1().modify(|w| {
            w.set_br(clock);
            w.set_dff(width);
        });
        SPI1.cr1().modify(|w| w.set_spe(true));
    }
}

/// Exchanges four bytes in two words. The second is sent once the first that came in has been fetched, and not while it
/// is on the wire, which would save some 20 cycles. A handler that comes in between may take longer than the 2 048 of a
/// word, as one that reads a line of the ASCII interface does. A word that nobody has fetched in time keeps out the
/// next one, for which this would wait for ever.
fn exchange_datagram(datagram: &mut Datagram) {
    let [a, b, c, d] = *datagram;
    let [a, b] = exchange(u16::from_be_bytes([a, b])).to_be_bytes();
    let [c, d] = exchange(u16::from_be_bytes([c, d])).to_be_bytes();
    *datagram = [a, b, c, d];
}

fn exchange_bytes(operation: &mut Operation<'_, u8>) {
    match operation {
        Operation::TransferInPlace(bytes) => exchange_in_place(bytes),
        Operation::Read(bytes) => bytes.fill_with(|| exchange(0) as u8),
        Operation::Write(bytes) => bytes.iter().for_each(|byte| {
            exchange((*byte).into());
        }),
        Operation::Transfer(to, from) => {
            let mut from = from.iter();
            to.fill_with(|| exchange(from.next().copied().unwrap_or_default().into()) as u8);
            from.for_each(|byte| {
                exchange((*byte).into());
            });
        }
        // 168 core cycles are a microsecond.
        Operation::DelayNs(time) => asm::delay((*time / 1_000 + 1).saturating_mul(168)),
    }
}

/// Exchanges bytes. Each follows as soon as the one before has been fetched.
fn exchange_in_place(bytes: &mut [u8]) {
    let mut bytes = bytes.iter_mut();
    let Some(mut place) = bytes.next() else { return };
    send((*place).into());
    for next in bytes {
        let byte = *next;
        let came = received();
        send(byte.into());
        *place = came as u8;
        place = next;
    }
    *place = received() as u8;
}

/// Sends a word and returns the one that comes in meanwhile.
fn exchange(word: u16) -> u16 {
    send(word);
    received()
}

/// Sends a word.
fn send(word: u16) {
    SPI1.dr().write(|w| w.set_dr(word));
}

/// The word that comes in next.
fn received() -> u16 {
    while !SPI1.sr().read().rxne() {}
    SPI1.dr().read().dr()
}
