//! The waking of the owner of the module, which runs in the interrupt of TIM3. The interrupt comes at the end of a span
//! of time, and whenever a link has something for the owner.

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::TIM3;

use crate::units::Micros;

/// Starts the timer. The owner runs at once.
pub(crate) fn start() {
    embassy_stm32::rcc::enable_and_reset::<embassy_stm32::peripherals::TIM3>();
    // 84 MHz / 84 makes microseconds. The prescaler takes effect at the update event that UG makes.
    TIM3.psc().write_value(83);
    TIM3.egr().write(|w| w.set_ug(true));
    TIM3.dier().write(|w| w.set_uie(true));
    interrupt::TIM3.set_priority(Priority::P6);
    // SAFETY: the handler uses the owner, which is in static memory already.
    unsafe { interrupt::TIM3.enable() };
    pend();
}

/// Wakes the owner after a span of time, at most a microsecond later and not before.
pub(crate) fn after(span: Micros) {
    // The timer is stopped first: otherwise its count could pass the new end before that is in force.
    TIM3.cr1().write(|_| {});
    TIM3.cnt().write(|w| w.set_cnt(0));
    // A count from 0 to `span` is `span` whole microseconds and a first one that may be shorter.
    TIM3.arr().write(|w| w.set_arr(span.0 as u16));
    TIM3.cr1().write(|w| {
        w.set_opm(true);
        w.set_cen(true);
    });
}

/// Clears the timer's interrupt: to be called when the owner has been woken.
pub(crate) fn acknowledge() {
    TIM3.sr().write(|w| w.set_uif(false));
}

/// Wakes the owner at once: to be called when a link has something for it.
pub(crate) fn pend() {
    NVIC::pend(interrupt::TIM3);
}
