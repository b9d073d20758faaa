//! The chip between the core, whose accesses arrive here, and the machine.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::mcu::cpu::Bus;
use crate::mcu::peripheral::Cycles;
use crate::mcu::soc::Soc;

/// The chip, as core and machine share it.
#[derive(Debug)]
pub(super) struct Shared {
    soc: Mutex<Soc>,
    /// The core's time.
    now: AtomicU64,
    /// When the chip wants attention: its next event, or at once after an access.
    due: AtomicU64,
}

impl Shared {
    pub(super) fn new(soc: Soc) -> Self {
        Self { soc: Mutex::new(soc), now: AtomicU64::new(0), due: AtomicU64::new(0) }
    }

    /// The core stands at cycle `now`.
    #[inline]
    pub(super) fn set_now(&self, now: Cycles) {
        self.now.store(now, Ordering::Relaxed);
    }

    /// When the chip wants attention; 0 after an access.
    #[inline]
    pub(super) fn due(&self) -> Cycles {
        self.due.load(Ordering::Relaxed)
    }

    /// The chip wants no attention before `due`, unless it is accessed.
    #[inline]
    pub(super) fn set_due(&self, due: Cycles) {
        self.due.store(due, Ordering::Relaxed);
    }

    #[inline]
    pub(super) fn lock(&self) -> MutexGuard<'_, Soc> {
        self.soc.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Bus for Shared {
    fn read(&self, address: u32, bytes: usize) -> u32 {
        let value = self.lock().read(self.now.load(Ordering::Relaxed), address, bytes);
        self.due.store(0, Ordering::Relaxed);
        value
    }

    fn write(&self, address: u32, bytes: usize, value: u32) {
        self.lock().write(self.now.load(Ordering::Relaxed), address, bytes, value);
        self.due.store(0, Ordering::Relaxed);
    }
}
