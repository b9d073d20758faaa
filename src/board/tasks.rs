//! Who runs where: the owner of the module and the links that hurry in interrupts, the rest in thread mode.

use embassy_executor::{SpawnError, SpawnToken, Spawner};

use super::tmcm1140::Board;
use super::{analog, can, eeprom, encoder, fault, owner, rs485, usb, watchdog};
use crate::module::{Tmcm1140, factory_reset};
use crate::store::Store;

/// Starts everything: the module, which stops the motor first and then reads what is stored, then the links. `spawner`
/// is that of thread mode.
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
    // The first poll knows the supply: without one, no program starts.
    let sensors = analog::Sensors::new(board.adc, board.analog);
    let owner = owner::build(board.motion, load, seed());
    if recovering {
        owner.module.hold_program();
    }
    let (baud, bit_rate) = (owner.module.baud_rate(), owner.module.can_bit_rate());
    defmt::info!("RS485 at {=u32} bit/s", baud);

    // The port before the owner: a byte is fetched in time whatever goes on.
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

/// Starts a task. Each is started once, so there is room for it; the watchdog would miss those that matter.
fn spawn<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    match task {
        Ok(task) => spawner.spawn(task),
        Err(error) => defmt::error!("a task does not start: {}", error),
    }
}

/// Something that differs between modules: the sum of the three words of the microcontroller's serial number.
fn seed() -> u32 {
    let serial = embassy_stm32::uid::uid();
    let (words, _) = serial.as_chunks();
    words.iter().copied().map(u32::from_le_bytes).fold(0, u32::wrapping_add)
}
