//! The keeping of what is stored. The EEPROM is read at start-up before the links are served, and later written page by
//! page in thread mode, while motion and links go on.

use embassy_time::Timer;

use super::handover::{PAGE, WRITTEN};
use crate::board::stm32f4::clocks::now;
use crate::board::stm32f4::eeprom::{Device, Eeprom};
use crate::board::stm32f4::watchdog;
use crate::chip::at25::At25;
use crate::store::{Integrity, Keeper, Memory, Store};

/// Makes the keeper of the EEPROM, which reads and writes it for the store.
pub(super) fn new(eeprom: Eeprom) -> Keeper<Device> {
    Keeper::new(At25::new(eeprom.device()))
}

/// Reads the store from the EEPROM, 16 384 bytes in 50 ms, and logs what was found.
pub(super) fn load<M: Memory>(keeper: &mut Keeper<Device>, store: &mut Store<M>) {
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
pub(super) async fn keep(mut keeper: Keeper<Device>) {
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
