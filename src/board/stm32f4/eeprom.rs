//! The EEPROM: it is read at start-up before the links are served, and later written page by page in thread mode, while
//! motion and links go on.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Output};
use embassy_stm32::spi::{Instance, MisoPin, MosiPin, SckPin};
use embassy_time::Timer;
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};

use super::clocks::now;
use super::spi::{self, Bus};
use super::{pins, watchdog};
use crate::board::runtime::mail::{PAGE, WRITTEN};
use crate::chip::at25::At25;
use crate::store::{Integrity, Keeper, Memory, Store};

type Device = ExclusiveDevice<Bus, Output<'static>, NoDelay>;

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
}

/// Makes the keeper of the EEPROM, which reads and writes it for the store.
pub(crate) fn keeper(eeprom: Eeprom) -> Keeper<Device> {
    // Chip select is set high here, as it is already; an output pin of a microcontroller cannot fail.
    let Ok(device) = ExclusiveDevice::new_no_delay(eeprom.bus, eeprom.select);
    Keeper::new(At25::new(device))
}

/// Reads the store from the EEPROM, 16 384 bytes in 50 ms, and logs what was found.
pub(crate) fn load<M: Memory>(keeper: &mut Keeper<Device>, store: &mut Store<M>) {
    let report = keeper.load(store);
    if report.unreachable {
        defmt::warn!("EEPROM does not answer: defaults apply, nothing can be stored");
    } else if report.foreign > 0 {
        defmt::warn!(
            "EEPROM: {=u8} settings pages are not this firmware's or damaged, {=u8} are good; defaults or the older copies apply",
            report.foreign,
            report.valid
        );
    }
    match report.program {
        Integrity::Empty => {}
        Integrity::Whole => defmt::info!("EEPROM holds a program"),
        Integrity::Incomplete => {
            defmt::warn!("EEPROM: the program is damaged or its download was cut short: it will not run")
        }
        Integrity::BeingErased(_) => defmt::info!("EEPROM: the program is being erased"),
    }
}

/// Writes the pages that the owner of the module hands over, one after the other, and reports each.
#[embassy_executor::task]
pub(crate) async fn keep(mut keeper: Keeper<Device>) {
    loop {
        let mut page = Some(watchdog::while_waiting(&watchdog::EEPROM, PAGE.wait()).await);
        let written = loop {
            watchdog::EEPROM.alive();
            if let Some(written) = keeper.poll(now(), || page.take()) {
                break written;
            }
            Timer::after_millis(1).await;
        };
        WRITTEN.signal(written);
    }
}
