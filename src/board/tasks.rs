//! Who runs where: the executors and their priorities.

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};

use super::tmcm1140::Board;
use super::{eeprom, owner, rs485};
use crate::module::Spec;
use crate::param::GlobalParameter;
use crate::store::{Slot, Store};

/// Rates of global parameter 65, in bit/s. From 42 MHz the port makes them all within 0.2 %.
const BAUD_RATES: [u32; 9] = [9_600, 14_400, 19_200, 28_800, 38_400, 57_600, 76_800, 115_200, 230_400];

/// Links. Runs in the interrupt of UART5, which is not connected.
static LINKS: InterruptExecutor = InterruptExecutor::new();
/// The module. Runs in the interrupt of UART4, likewise.
static MODULE: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
unsafe fn UART5() {
    // SAFETY: called from nowhere else, and the interrupt is enabled by `start`.
    unsafe { LINKS.on_interrupt() }
}

#[interrupt]
unsafe fn UART4() {
    // SAFETY: as above.
    unsafe { MODULE.on_interrupt() }
}

/// Starts everything: the module, which stops the motor first and then reads what is stored, then the links. `spawner` is that of
/// thread mode.
pub fn run(board: Board, spec: &'static Spec, spawner: Spawner) {
    let mut keeper = eeprom::keeper(board.eeprom);
    let owner = owner::build(spec, board.motion, |store| eeprom::load(&mut keeper, store), seed());
    let baud = baud_rate(owner.module.store());
    defmt::info!("RS485 at {=u32} bit/s", baud);
    let (port, direction) = defmt::unwrap!(board.rs485.open(baud));

    // The port before the link before the module: a byte is fetched in time whatever goes on.
    interrupt::USART3.set_priority(Priority::P4);
    interrupt::UART5.set_priority(Priority::P5);
    interrupt::UART4.set_priority(Priority::P6);
    // Each task is started once, so there is room for it.
    // The module runs as soon as it is spawned, so it is there when the link asks for the mode to start in.
    let module = defmt::unwrap!(owner::own(owner));
    MODULE.start(interrupt::UART4).spawn(module);
    LINKS.start(interrupt::UART5).spawn(defmt::unwrap!(rs485::carry(port, direction)));
    spawner.spawn(defmt::unwrap!(eeprom::keep(keeper)));
}

fn baud_rate(store: &Store) -> u32 {
    let [default, ..] = BAUD_RATES;
    let number = store.get(Slot::Global(GlobalParameter::SerialBaudRate)).and_then(|n| usize::try_from(n).ok());
    number.and_then(|n| BAUD_RATES.get(n)).copied().unwrap_or(default)
}

/// Something that differs between modules: the sum of the three words of the microcontroller's serial number.
fn seed() -> u32 {
    let serial = embassy_stm32::uid::uid();
    let (words, _) = serial.as_chunks();
    words.iter().copied().map(u32::from_le_bytes).fold(0, u32::wrapping_add)
}
