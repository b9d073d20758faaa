//! The external ABN encoder at IN1, IN2 (A and B) and IN3 (N): counted by TIM4; where the count was at an edge of N is
//! noted by the interrupt of that pin.

use core::cell::Cell;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::{EXTI, GPIOD, SYSCFG, TIM4};
use embassy_sync::blocking_mutex::CriticalSectionMutex;

/// The pin of N, PD14.
const NULL: usize = 14;
/// Port D in SYSCFG_EXTICR.
const PORT_D: u8 = 3;

/// The count at the last edge to low and to high that nobody has asked for yet.
static EDGES: CriticalSectionMutex<Cell<[Option<u16>; 2]>> = CriticalSectionMutex::new(Cell::new([None; 2]));

/// Starts watching N. TIM4 counts already.
pub(super) fn start() {
    SYSCFG.exticr(NULL / 4).modify(|w| w.set_exti(NULL % 4, PORT_D));
    EXTI.rtsr(0).modify(|w| w.set_line(NULL, true));
    EXTI.ftsr(0).modify(|w| w.set_line(NULL, true));
    EXTI.imr(0).modify(|w| w.set_line(NULL, true));
    interrupt::EXTI15_10.set_priority(Priority::P3);
    // SAFETY: the handler has what it needs.
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

/// The count, wrapping.
pub(super) fn count() -> u16 {
    TIM4.cnt().read().cnt()
}

/// Where the count was at the last edge of N to low, and to high, since the last call.
pub(super) fn edges() -> [Option<u16>; 2] {
    EDGES.lock(|edges| edges.replace([None; 2]))
}
