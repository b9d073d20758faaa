//! Two words in RAM that survive a restart of the firmware, but not the loss of the supply. Only the node of CANopen has a use
//! for them: its address.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

struct Words(UnsafeCell<MaybeUninit<[u32; 2]>>);

// SAFETY: the words are read at the start, before interrupts are on, and written there and by the owner of the firmware.
unsafe impl Sync for Words {}

// The start-up code does not initialise this section.
#[unsafe(link_section = ".uninit.kept")]
static WORDS: Words = Words(UnsafeCell::new(MaybeUninit::uninit()));

/// What was kept. At power-on the words may be anything: who has kept them sees that by a check sum.
pub(super) fn read() -> [u32; 2] {
    // SAFETY: nobody writes now, and any bits are two words.
    unsafe { core::ptr::read_volatile(WORDS.0.get()).assume_init() }
}

/// Keeps two words.
pub(super) fn write(words: [u32; 2]) {
    // SAFETY: nobody else accesses the words now.
    unsafe { core::ptr::write_volatile(WORDS.0.get(), MaybeUninit::new(words)) };
}
