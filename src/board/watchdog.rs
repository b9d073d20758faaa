//! The independent watchdog. It is fed only while the owner of the module and the tasks all give signs of life: a
//! firmware in which one part hangs is started anew, with the motor stopped.

use core::future::Future;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_futures::select::{Either, select};
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::Timer;

/// Without being fed for so long it bites. The LSI clock is between 17 and 47 kHz in place of 32: 170 to 470 ms.
pub(super) const TIMEOUT_US: u32 = 250_000;
/// It is fed as often, if all are alive.
const ROUND_MS: u64 = 50;
/// A task that waits gives a sign of life as often.
const SIGN_MS: u64 = 20;

/// Whether a part has given a sign of life since the last round.
pub(super) struct Part(AtomicBool);

/// The owner of the module: motion, interpreter, CAN, RS485's answers.
pub(super) static MODULE: Part = Part(AtomicBool::new(false));
/// The EEPROM.
pub(super) static EEPROM: Part = Part(AtomicBool::new(false));
/// The USB link.
pub(super) static USB: Part = Part(AtomicBool::new(false));

impl Part {
    /// Gives a sign of life.
    pub(super) fn alive(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn was_alive(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }
}

/// Waits for something and gives signs of life meanwhile: a task may wait as long as it likes, but it has to be run.
pub(super) async fn while_waiting<F: Future>(part: &Part, future: F) -> F::Output {
    let mut future = core::pin::pin!(future);
    loop {
        part.alive();
        match select(future.as_mut(), Timer::after_millis(SIGN_MS)).await {
            Either::First(done) => return done,
            Either::Second(()) => {}
        }
    }
}

/// Feeds the watchdog, for the first time at once: until then it takes twice as long.
#[embassy_executor::task]
pub(super) async fn feed(mut watchdog: IndependentWatchdog<'static, IWDG>) {
    watchdog.pet();
    loop {
        Timer::after_millis(ROUND_MS).await;
        let alive = [&MODULE, &EEPROM, &USB].map(Part::was_alive);
        if alive == [true; 3] {
            watchdog.pet();
        } else {
            defmt::error!("no sign of life: module, EEPROM, USB {}", alive);
        }
    }
}
