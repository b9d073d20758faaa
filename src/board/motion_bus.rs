//! The bus of the motion chips, SPI1, on which each chip has its own clock.
//!
//! Bytes are exchanged at the port's registers: four of them go out with each request that asks a chip something, and
//! in each poll.

use core::convert::Infallible;

use cortex_m::asm;
use embassy_stm32::gpio::Output;
use embassy_stm32::pac::SPI1;
use embassy_stm32::pac::spi::vals::Br;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};

use super::spi::Bus;

/// Clock of the TMC429: 84 MHz / 64. The chip, itself at 16 MHz, takes 2 MHz at most (eight of its clocks
/// a bit); 84 MHz / 32 would be too fast.
const TMC429_CLOCK: Br = Br::DIV64;
/// Clock of the TMC262: 84 MHz / 32.
const TMC262_CLOCK: Br = Br::DIV32;

/// Chip select is to be low for three clocks of the TMC429 - 188 ns, 32 cycles - before the first edge. From the end of
/// this wait to there it takes more than the other half.
const SETUP_CYCLES: u32 = 16;

/// A chip on the bus. Whoever has one is not interrupted by who has another: all are the owner's.
pub(super) struct Chip {
    select: Output<'static>,
    clock: Br,
}

/// The TMC429 and the TMC262 on the bus, which is set up for mode 3.
pub(super) fn chips(bus: Bus, tmc429: Output<'static>, tmc262: Output<'static>) -> (Chip, Chip) {
    // Dropped, it would switch the port off.
    core::mem::forget(bus);
    (Chip { select: tmc429, clock: TMC429_CLOCK }, Chip { select: tmc262, clock: TMC262_CLOCK })
}

impl ErrorType for Chip {
    type Error = Infallible;
}

impl SpiDevice for Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        if SPI1.cr1().read().br() != self.clock {
            SPI1.cr1().modify(|w| w.set_spe(false));
            SPI1.cr1().modify(|w| w.set_br(self.clock));
            SPI1.cr1().modify(|w| w.set_spe(true));
        }
        self.select.set_low();
        asm::delay(SETUP_CYCLES);
        for operation in operations {
            match operation {
                Operation::TransferInPlace(bytes) => bytes.iter_mut().for_each(|byte| *byte = exchange(*byte)),
                Operation::Read(bytes) => bytes.fill_with(|| exchange(0)),
                Operation::Write(bytes) => bytes.iter().for_each(|byte| {
                    exchange(*byte);
                }),
                Operation::Transfer(to, from) => {
                    let mut from = from.iter();
                    to.fill_with(|| exchange(from.next().copied().unwrap_or_default()));
                    from.for_each(|byte| {
                        exchange(*byte);
                    });
                }
                // 168 cycles are a microsecond.
                Operation::DelayNs(time) => asm::delay((*time / 1_000 + 1).saturating_mul(168)),
            }
        }
        // The last edge is in the middle of the last bit: the other half of it, 64 cycles, is more than the three clocks
        // of the TMC429 that chip select is to stay low.
        while SPI1.sr().read().bsy() {}
        self.select.set_high();
        Ok(())
    }
}

/// Sends a byte and gives the one that comes in meanwhile.
fn exchange(byte: u8) -> u8 {
    SPI1.dr().write(|w| w.set_dr(byte.into()));
    while !SPI1.sr().read().rxne() {}
    SPI1.dr().read().dr() as u8
}
