//! Waking the owner of the module: it runs in the interrupt of TIM3, which comes at the end of a span of time, and
//! whenever somebody has something for it.

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::typelevel::{CAN1_RX0, Handler};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::TIM3;

use crate::units::Micros;

/// Starts the timer; the owner runs at once.
pub(super) fn start() {
    embassy_stm32::rcc::enable_and_reset::<embassy_stm32::peripherals::TIM3>();
    // 84 MHz / 84: microseconds. The prescaler is taken over by an update.
    TIM3.psc().write_value(83);
    TIM3.egr().write(|w| w.set_ug(true));
    TIM3.dier().write(|w| w.set_uie(true));
    interrupt::TIM3.set_priority(Priority::P6);
    // SAFETY: the handler has what it needs; it is the owner's, which is at its place.
    unsafe { interrupt::TIM3.enable() };
    pend();
}

/// Wakes the owner after a span of time, or at most a microsecond later, but not before.
pub(super) fn after(span: Micros) {
    // Were the timer running, its count could be past the new end before this is in force.
    TIM3.cr1().write(|_| {});
    TIM3.cnt().write(|w| w.set_cnt(0));
    // The first of `span + 1` counts may be a short one.
    TIM3.arr().write(|w| w.set_arr(span.0 as u16));
    TIM3.cr1().write(|w| {
        w.set_opm(true);
        w.set_cen(true);
    });
}

/// The owner has been woken: the timer asks no more.
pub(super) fn acknowledge() {
    TIM3.sr().write(|w| w.set_uif(false));
}

/// A link has something for the owner, which is woken at once.
pub(super) fn pend() {
    NVIC::pend(interrupt::TIM3);
}

/// Wakes the owner when a frame has come on the CAN bus.
pub(super) struct OnFrame;

impl Handler<CAN1_RX0> for OnFrame {
    unsafe fn on_interrupt() {
        pend();
    }
}
