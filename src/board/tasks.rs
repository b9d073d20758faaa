//! The start of the firmware: the module and the fast links are given to their interrupts, and the tasks of thread mode
//! are started.

use embassy_executor::{SpawnError, SpawnToken, Spawner};

use super::tmcm1140::Board;
use super::{analog, can, eeprom, encoder, fault, owner, rs485, usb, watchdog};
use crate::module::{Tmcm1140, factory_reset};
use crate::store::Store;

/// Starts the firmware: first the module, which stops the motor and then reads what is stored, and then the links.
/// `spawner` is that of thread mode.
pub fn run(board: Board, spawner: Spawner) {
    let recovering = fault::report();
    let mut keeper = eeprom::keeper(board.eeprom);
    let reset = board.factory_reset;
    let load = |store: &mut Store<Tmcm1140>| {
        eeprom::load(&mut keeper, store);
        if reset {
            defmt::warn!("pads connected: factory settings");
            factory_reset(store);
        }
    };
    // The supply is measured before the first poll, so that without a supply no program starts.
    let sensors = analog::Sensors::new(board.adc, board.analog);
    let owner = owner::build(board.motion, load, seed());
    if recovering {
        owner.module.hold_program();
    }
    let (baud, bit_rate) = (owner.module.baud_rate(), owner.module.can_bit_rate());
    defmt::info!("RS485 at {=u32} bit/s", baud);

    // The port starts before the owner of the module, so that the first bytes are fetched in time.
    match board.rs485.open(baud) {
        Ok(direction) => rs485::start(direction, owner.module.link_settings().start),
        Err(error) => defmt::error!("RS485 stays off: {}", error),
    }
    encoder::start();
    let (device, serial) = usb::build(board.usb, owner.module.spec().usb, usb::serial_number());
    owner::start(owner);
    spawn(spawner, eeprom::keep(keeper));
    spawn(spawner, usb::run(device));
    spawn(spawner, usb::carry(serial));
    spawn(spawner, can::join(board.can, bit_rate));
    spawn(spawner, analog::watch(sensors));
    spawn(spawner, watchdog::feed(board.watchdog));
}

/// Starts a task of thread mode. Each task is started once, so there is memory for it. If an important one did not
/// start, the watchdog would restart the firmware.
fn spawn<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    match task {
        Ok(task) => spawner.spawn(task),
        Err(error) => defmt::error!("a task does not start: {}", error),
    }
}

/// The seed of the random numbers, which differs between modules: the sum of the three words of the microcontroller's
/// serial number.
fn seed() -> u32 {
    let serial = embassy_stm32::uid::uid();
    let (words, _) = serial.as_chunks();
    words.iter().copied().map(u32::from_le_bytes).fold(0, u32::wrapping_add)
}
