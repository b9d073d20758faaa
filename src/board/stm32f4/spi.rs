//! The two SPI ports as they are set up: that of the motion chips and that of the EEPROM.

use embassy_stm32::Peri;
use embassy_stm32::gpio::Pull;
use embassy_stm32::mode::Blocking;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Instance, MisoPin, MosiPin, SckPin, Spi};
use embassy_stm32::time::Hertz;

/// SPI clock of the EEPROM: 42 MHz / 16, as on the sibling module. The motion bus begins with this clock, too, until
/// its chips choose their own.
const CLOCK: Hertz = Hertz(2_625_000);

/// An SPI bus whose transfers block until they are done.
pub(super) type Bus = Spi<'static, Blocking, Master>;

/// Sets up a port. All parts use mode 3, and with a pull-up resistor at the input a missing part reads as all ones.
#[inline(always)]
pub(super) fn port<T: Instance>(
    port: Peri<'static, T>,
    clock: Peri<'static, impl SckPin<T>>,
    output: Peri<'static, impl MosiPin<T>>,
    input: Peri<'static, impl MisoPin<T>>,
) -> Bus {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    config.frequency = CLOCK;
    config.miso_pull = Pull::Up;
    Spi::new_blocking(port, clock, output, input, config)
}
