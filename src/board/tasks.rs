//! Who runs where: the owner of the module and the links that hurry in interrupts, the rest in thread mode.

use embassy_executor::{SpawnError, SpawnToken, Spawner};

use super::tmcm1140::Board;
use super::{analog, can, eeprom, encoder, fault, owner, rs485, usb, watchdog};
use crate::module::Spec;
use crate::param::GlobalParameter;
use crate::store::{Slot, Store};

/// Rates of global parameter 65, in bit/s. From 42 MHz the port makes them all within 0.2 %.
const BAUD_RATES: [u32; 9] = [9_600, 14_400, 19_200, 28_800, 38_400, 57_600, 76_800, 115_200, 230_400];
/// Rates of global parameter 69, which begins with 2, in bit/s.
const BIT_RATES: [u32; 7] = [20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 1_000_000];
const FIRST_BIT_RATE: usize = 2;

/// Starts everything: the module, which stops the motor first and then reads what is stored, then the links. `spawner`
/// is that of thread mode.
pub fn run(board: Board, spec: &'static Spec, spawner: Spawner) {
    let recovering = fault::report();
    let mut keeper = eeprom::keeper(board.eeprom);
    let reset = board.factory_reset;
    let load = |store: &mut Store| {
        eeprom::load(&mut keeper, store);
        if reset {
            defmt::warn!("pads connected: factory settings");
            store.reset();
        }
    };
    let owner = owner::build(spec, board.motion, load, seed());
    if recovering {
        owner.module.hold_program();
    }
    let baud = chosen(owner.module.store(), GlobalParameter::SerialBaudRate, &BAUD_RATES, 0);
    let bit_rate = chosen(owner.module.store(), GlobalParameter::CanBitRate, &BIT_RATES, FIRST_BIT_RATE);
    defmt::info!("RS485 at {=u32} bit/s", baud);

    // The port before the owner: a byte is fetched in time whatever goes on.
    match board.rs485.open(baud) {
        Ok(direction) => rs485::start(direction, *owner.module.links()),
        Err(error) => defmt::error!("RS485 stays off: {}", error),
    }
    encoder::start();
    let (device, serial) = usb::build(board.usb, usb::serial_number());
    owner::start(owner);
    spawn(spawner, eeprom::keep(keeper));
    spawn(spawner, usb::run(device));
    spawn(spawner, usb::carry(serial));
    spawn(spawner, can::join(board.can, bit_rate));
    spawn(spawner, analog::read(board.adc, board.analog));
    spawn(spawner, watchdog::feed(board.watchdog));
}

/// Starts a task. Each is started once, so there is room for it; the watchdog would miss those that matter.
fn spawn<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    match task {
        Ok(task) => spawner.spawn(task),
        Err(error) => defmt::error!("a task does not start: {}", error),
    }
}

/// What a stored parameter chooses from a list whose first entry has the number `first`; the factory default where it
/// chooses none.
fn chosen(store: &Store, parameter: GlobalParameter, list: &[u32], first: usize) -> u32 {
    let entry = |number: i32| list.get(usize::try_from(number).ok()?.checked_sub(first)?).copied();
    let stored = store.get(Slot::Global(parameter)).and_then(entry);
    stored.or_else(|| entry(parameter.row().default)).unwrap_or_default()
}

/// Something that differs between modules: the sum of the three words of the microcontroller's serial number.
fn seed() -> u32 {
    let serial = embassy_stm32::uid::uid();
    let (words, _) = serial.as_chunks();
    words.iter().copied().map(u32::from_le_bytes).fold(0, u32::wrapping_add)
}
