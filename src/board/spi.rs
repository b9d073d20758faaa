//! The SPI ports as they start: those of the motion chips and of the EEPROM.

use embassy_stm32::gpio::Pull;
use embassy_stm32::mode::Blocking;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;

/// SPI clock of the EEPROM: 42 MHz / 16. The sibling divides by 16, too. The motion bus begins with it as well, until its
/// chips choose their own.
const CLOCK: Hertz = Hertz(2_625_000);

/// An SPI bus whose transfers are waited for.
pub(super) type Bus = Spi<'static, Blocking, Master>;

/// All parts use mode 3, and a part that is missing reads as all ones.
pub(super) fn config() -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    config.frequency = CLOCK;
    config.miso_pull = Pull::Up;
    config
}
