//! The EEPROM's bus, SPI3, with the chip select.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Output};
use embassy_stm32::spi::{Instance, MisoPin, MosiPin, SckPin};
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};

use super::pins;
use super::spi::{self, Bus};

/// The EEPROM on its bus, as its driver wants it.
pub(crate) type Device = ExclusiveDevice<Bus, Output<'static>, NoDelay>;

/// The EEPROM, which has an SPI bus of its own.
pub(crate) struct Eeprom {
    bus: Bus,
    select: Output<'static>,
}

impl Eeprom {
    /// Sets up the bus, with the pins of its clock, output and input, and the chip select.
    #[inline(always)]
    pub(crate) fn new<T: Instance>(
        port: Peri<'static, T>,
        clock: Peri<'static, impl SckPin<T>>,
        output: Peri<'static, impl MosiPin<T>>,
        input: Peri<'static, impl MisoPin<T>>,
        select: Peri<'static, AnyPin>,
    ) -> Self {
        Eeprom { bus: spi::port(port, clock, output, input), select: pins::select(select) }
    }

    /// Joins bus and chip select.
    pub(crate) fn device(self) -> Device {
        // Chip select is set high here, as it is already; an output pin of a microcontroller cannot fail.
        let Ok(device) = ExclusiveDevice::new_no_delay(self.bus, self.select);
        device
    }
}
