//! What happens when nothing can go on: motor drivers off, LED2 on, a message, and stop.
//!
//! Stop, not restart: a module that came back by itself would have lost its position and might start its
//! program, with nobody told. Silent, it is noticed by its host and waits for power-off or a debugger.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm;
use cortex_m_rt::{ExceptionFrame, exception};

use super::tmcm1140::{drivers_off, show_trouble};

/// The end of a panic.
pub fn panicked(info: &PanicInfo) -> ! {
    make_safe();
    defmt::error!("{}", defmt::Display2Format(info));
    stop()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    make_safe();
    defmt::error!("hard fault at {=u32:#x}, called from {=u32:#x}", frame.pc(), frame.lr());
    stop()
}

/// Exceptions and interrupts that nobody expects.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    make_safe();
    defmt::error!("unexpected interrupt {=i16}", number);
    stop()
}

/// From here on no task and no interrupt handler runs any more, and the motor is without current.
fn make_safe() {
    static ENTERED: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    drivers_off();
    show_trouble();
    // Trouble while telling of trouble, as when it began in the middle of a message: say no more.
    if ENTERED.swap(true, Ordering::Relaxed) {
        stop();
    }
}

fn stop() -> ! {
    loop {
        asm::wfi();
    }
}
