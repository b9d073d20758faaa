//! The start of the firmware: its owner and the fast links are given to their interrupts, and the tasks of thread mode
//! are started.

use core::arch::global_asm;

use embassy_executor::{Executor, SpawnError, SpawnToken, Spawner};
use embassy_stm32::peripherals::USB_OTG_FS;
use embassy_stm32::usb::Driver;

use super::handover::link_settings;
use super::owner::Room;
use super::runs::Runs;
use super::safe::{drivers_off, show_trouble};
use super::{fault, keeper, owner, usb_link};
use crate::board::boards::chosen::{Chips, Components, Rs485};
use crate::board::stm32f4::can_link::CanLink;
use crate::board::stm32f4::clocks::now;
use crate::board::stm32f4::eeprom::Eeprom;
use crate::board::stm32f4::{analog, can, usb, watchdog};
use crate::module::Hooks;
use crate::store::Memory;

// `drivers_off` runs first of all after reset, before RAM is initialised and the clock is fast, which takes a
// millisecond. At reset ENN floats, and only a resistor on the board, if there is one, keeps it high. The stack can be
// used at that time, but no statics, and `drivers_off` uses none. The name that cortex-m-rt has for this function can
// be defined in assembler only.
global_asm!(".global __pre_init", ".thumb_func", "__pre_init: b {first}", first = sym drivers_off);

/// Runs a firmware in its `room`, for ever: all that an image does.
#[inline(always)]
pub fn run<F, P, H>(room: &'static Room<F>) -> !
where
    F: Runs<Circuit = Chips<P, H>>,
    P: Memory + 'static,
    H: Hooks,
{
    let mut executor = Executor::new();
    // SAFETY: this function does not return, so the executor stays where it is.
    let executor = unsafe { core::mem::transmute::<&mut Executor, &'static mut Executor>(&mut executor) };
    executor.run(|spawner| start(room, spawner))
}

/// Sets up the board, and starts a firmware in its `room`: first its motors are stopped and what is stored is read,
/// then come the links. `spawner` is that of thread mode.
///
/// Each step is a function of its own that is not inlined: what it takes of the stack is free again for the next one.
#[inline(always)]
fn start<F, P, H>(room: &'static Room<F>, spawner: Spawner)
where
    F: Runs<Circuit = Chips<P, H>>,
    P: Memory + 'static,
    H: Hooks,
{
    // LED2 is on until the set-up has succeeded: it stays on if the crystal does not start.
    show_trouble(true);
    let board = Components::start();
    let recovering = fault::report();
    // The supply is measured before the first poll, so that without a supply no program starts.
    start_sensors(board.analog, spawner);
    let owner = owner::build(room, board.motors, board.signals, seed());
    start_store(&mut owner.firmware, board.eeprom, board.factory_reset, spawner);
    if recovering {
        owner.firmware.recover();
    }
    // The port starts before the owner, so that the first bytes are fetched in time.
    start_rs485(&owner.firmware, board.rs485);
    start_usb(board.usb, owner.firmware.usb_name(), spawner);
    spawn(spawner, can::join(board.can, F::Can::IN_ORDER));
    spawn(spawner, watchdog::feed(board.watchdog));
    owner::start(owner);
}

#[inline(never)]
fn start_sensors(inputs: analog::Inputs, spawner: Spawner) {
    spawn(spawner, analog::watch(analog::Sensors::new(inputs)));
}

/// Reads what is stored, and starts the task that will write it.
#[inline(never)]
fn start_store<F, P, H>(firmware: &mut F, eeprom: Eeprom, factory_reset: bool, spawner: Spawner)
where
    F: Runs<Circuit = Chips<P, H>>,
    P: Memory + 'static,
    H: Hooks,
{
    firmware.remember(owner::kept());
    let mut keeper = keeper::new(eeprom);
    firmware.start(now(), |store| {
        keeper::load(&mut keeper, store);
        if factory_reset {
            defmt::warn!("pads connected: factory settings");
            F::factory_reset(store);
        }
    });
    firmware.introduce();
    spawn(spawner, keeper::keep(keeper));
}

#[inline(never)]
fn start_rs485<F: Runs>(firmware: &F, pins: Rs485) {
    let Some(baud) = firmware.baud_rate() else { return };
    defmt::info!("RS485 at {=u32} bit/s", baud);
    if let Err(error) = pins.start(baud, firmware.link_settings().start, link_settings) {
        defmt::error!("RS485 stays off: {}", error);
    }
}

#[inline(never)]
fn start_usb(driver: Driver<'static, USB_OTG_FS>, product: &'static str, spawner: Spawner) {
    let (device, serial) = usb::build(driver, product, usb::serial_number());
    spawn(spawner, usb::run(device));
    spawn(spawner, usb_link::carry(serial));
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
