//! The external ABN encoder: A and B at IN1 and IN2 are counted by TIM4, and the interrupt of IN3, which is N, notes
//! the count at each edge.

use core::cell::Cell;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::{EXTI, GPIOD, SYSCFG, TIM4};
use embassy_sync::blocking_mutex::CriticalSectionMutex;

/// Number in port D of the pin of N, PD14.
const NULL: usize = 14;
/// Number of port D in SYSCFG_EXTICR.
const PORT_D: u8 = 3;

/// The counts at the last edge of N to low and at that to high, since they were last read.
static EDGES: CriticalSectionMutex<Cell<[Option<u16>; 2]>> = CriticalSectionMutex::new(Cell::new([None; 2]));

/// Enables the interrupt of N. TIM4 is counting already.
pub(super) fn start() {
    SYSCFG.exticr(NULL / 4).modify(|w| w.set_exti(NULL % 4, PORT_D));
    EXTI.rtsr(0).modify(|w| w.set_line(NULL, true));
    EXTI.ftsr(0).modify(|w| w.set_line(NULL, true));
    EXTI.imr(0).modify(|w| w.set_line(NULL, true));
    interrupt::EXTI15_10.set_priority(Priority::P3);
    // SAFETY: the handler uses only registers and `EDGES`, which exist.
    unsafe { interrupt::EXTI15_10.enable() };
}

#[interrupt]
unsafe fn EXTI15_10() {
    EXTI.pr(0).write(|w| w.set_line(NULL, true));
    let count = count();
    let high = GPIOD.idr().read().idr(NULL) == embassy_stm32::pac::gpio::vals::Idr::HIGH;
    EDGES.lock(|edges| {
        let [low_at, high_at] = edges.get();
        edges.set(if high { [low_at, Some(count)] } else { [Some(count), high_at] });
    });
}

/// The count of A and B, which wraps at 65 536.
pub(super) fn count() -> u16 {
    TIM4.cnt().read().cnt()
}

/// The counts at the last edge of N to low and at that to high since the last call; `None` without such an edge.
pub(super) fn edges() -> [Option<u16>; 2] {
    EDGES.lock(|edges| edges.replace([None; 2]))
}
