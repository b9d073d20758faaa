//! The independent watchdog. It is fed only while the owner of the module and the tasks for EEPROM and USB give signs
//! of life. If one of them hangs, the firmware is restarted, with the motor stopped.

use core::future::Future;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_futures::select::{Either, select};
use embassy_stm32::Peri;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::Timer;

/// Time in us after which the watchdog restarts a firmware that does not feed it. Its clock, the LSI, has between 17
/// and 47 kHz in place of 32 kHz, so the real time is 170 to 470 ms.
const TIMEOUT_US: u32 = 250_000;
/// Time between two feedings, in ms, while all parts are alive.
const ROUND_MS: u64 = 50;
/// Time between two signs of life of a task that waits, in ms.
const SIGN_MS: u64 = 20;

/// Whether a part of the firmware has given a sign of life since the last feeding.
pub(crate) struct Part(AtomicBool);

/// The owner of the module: motion, programs, CAN, and the replies on RS485.
pub(crate) static MODULE: Part = Part(AtomicBool::new(false));
/// The task that writes the EEPROM.
pub(crate) static EEPROM: Part = Part(AtomicBool::new(false));
/// The task of the USB link.
pub(crate) static USB: Part = Part(AtomicBool::new(false));

impl Part {
    /// Gives a sign of life.
    pub(crate) fn alive(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn was_alive(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }
}

/// Sets the watchdog up, which runs already: it takes [`TIMEOUT_US`] when it is fed first.
pub(crate) fn start(watchdog: Peri<'static, IWDG>) -> IndependentWatchdog<'static, IWDG> {
    IndependentWatchdog::new(watchdog, TIMEOUT_US)
}

/// Waits for a future and gives signs of life meanwhile: a task may wait for any time, but it has to be run.
pub(crate) async fn while_waiting<F: Future>(part: &Part, future: F) -> F::Output {
    let mut future = core::pin::pin!(future);
    loop {
        part.alive();
        match select(future.as_mut(), Timer::after_millis(SIGN_MS)).await {
            Either::First(done) => return done,
            Either::Second(()) => {}
        }
    }
}

/// Feeds the watchdog, for the first time at once, because until then the watchdog has its default time of 512 ms.
#[embassy_executor::task]
pub(crate) async fn feed(mut watchdog: IndependentWatchdog<'static, IWDG>) {
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
