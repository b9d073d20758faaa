//! The start of the firmware: its owner and the fast links are given to their interrupts, and the tasks of thread mode
//! are started.

use core::arch::global_asm;

use embassy_executor::{SpawnError, SpawnToken, Spawner};

use super::chosen::{AXES, Board, Chips, drivers_off};
use super::firmware::Firmware;
use super::owner::Room;
use super::{analog, can, eeprom, fault, now, owner, usb, watchdog};
use crate::store::Memory;

// `drivers_off` runs first of all after reset, before RAM is initialised and the clock is fast, which takes a
// millisecond: at reset ENN floats, and only a resistor on the board, if there is one, keeps it high. The stack can be
// used at that time, but no statics, and `drivers_off` uses none. The name that cortex-m-rt has for this function can
// be defined in assembler only.
global_asm!(".global __pre_init", ".thumb_func", "__pre_init: b {first}", first = sym drivers_off);

/// Starts a firmware in its `room`: first its motors are stopped and what is stored is read, then come the links.
/// `spawner` is that of thread mode.
pub fn run<F, P>(board: Board, room: &'static Room<F>, spawner: Spawner)
where
    F: Firmware<AXES, Board = Chips<P>>,
    P: Memory + 'static,
{
    let recovering = fault::report();
    let mut keeper = eeprom::keeper(board.eeprom);
    // The supply is measured before the first poll, so that without a supply no program starts.
    let sensors = analog::Sensors::new(board.adc, board.analog);
    let owner = owner::build(room, board.motion, board.signals, seed());
    let firmware = &mut owner.firmware;
    firmware.start(now(), |store| {
        eeprom::load(&mut keeper, store);
        if board.factory_reset {
            defmt::warn!("pads connected: factory settings");
            F::factory_reset(store);
        }
    });
    if recovering {
        firmware.recover();
    }
    // The port starts before the owner, so that the first bytes are fetched in time.
    if let Some(baud) = firmware.baud_rate() {
        defmt::info!("RS485 at {=u32} bit/s", baud);
        if let Err(error) = board.rs485.start(baud, firmware.link_settings().start) {
            defmt::error!("RS485 stays off: {}", error);
        }
    }
    let bit_rate = firmware.can_bit_rate();
    let (device, serial) = usb::build(board.usb, firmware.usb_name(), usb::serial_number());
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
