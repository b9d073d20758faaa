//! Memory that survives a restart of the firmware, but not the loss of the supply.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// A value in such memory: to be a static in a section whose name begins with `.uninit`, which the start-up code does
/// not initialise. At power-on it may be anything, so it needs a check sum of its own.
pub(crate) struct Kept<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: those who call `read` and `write` see to it that no two of them do so at once.
unsafe impl<T> Sync for Kept<T> {}

impl<T: Copy> Kept<T> {
    /// Whatever the memory holds.
    pub(crate) const fn new() -> Self {
        Kept(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// Reads what the memory holds.
    ///
    /// # Safety
    /// Nobody writes meanwhile, and any bits are a `T`.
    pub(crate) unsafe fn read(&self) -> T {
        // SAFETY: the caller says so.
        unsafe { core::ptr::read_volatile(self.0.get()).assume_init() }
    }

    /// Keeps a value.
    ///
    /// # Safety
    /// Nobody else reads or writes meanwhile.
    pub(crate) unsafe fn write(&self, value: T) {
        // SAFETY: the caller says so.
        unsafe { core::ptr::write_volatile(self.0.get(), MaybeUninit::new(value)) };
    }
}
