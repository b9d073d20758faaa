//! What happens when nothing can go on: motor drivers off, LED2 on, the reason noted, and a restart by the watchdog.
//!
//! A module that came back as if nothing had happened would have lost its position and might start its program, with
//! nobody told. So it comes back without a program running, LED2 stays on until the next good start, and the log says
//! why.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac::RCC;

use super::tmcm1140::{drivers_off, show_trouble};

/// Why the firmware could not go on; kept through the restart.
#[derive(Clone, Copy)]
#[repr(C)]
struct Note {
    /// [`MAGIC`] if the rest means something.
    magic: u32,
    kind: u32,
    details: [u32; 3],
    check: u32,
}

const MAGIC: u32 = 0x7A11_5E1F;

/// Kinds of notes.
const PANIC: u32 = 1;
const HARD_FAULT: u32 = 2;
const INTERRUPT: u32 = 3;
const CRYSTAL: u32 = 4;

/// Memory that a restart leaves as it is.
struct Kept(UnsafeCell<MaybeUninit<Note>>);

// SAFETY: written with interrupts off, read before they are on.
unsafe impl Sync for Kept {}

#[unsafe(link_section = ".uninit.fault")]
static NOTE: Kept = Kept(UnsafeCell::new(MaybeUninit::uninit()));

/// The longest file name of ours that is believed.
const NAME: u32 = 120;

impl Note {
    fn check(&self) -> u32 {
        self.details.iter().fold(!self.kind, |sum, word| sum.rotate_left(5) ^ word)
    }
}

/// The end of a panic.
pub fn panicked(info: &PanicInfo) -> ! {
    make_safe();
    // The file name lies in the flash and can be read after the restart.
    let place = info.location().map_or([0; 3], |at| {
        let file = at.file();
        [file.as_ptr() as u32, file.len() as u32, at.line()]
    });
    note(PANIC, place);
    defmt::error!("{}", defmt::Display2Format(info));
    stop()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    make_safe();
    note(HARD_FAULT, [frame.pc(), frame.lr(), frame.xpsr()]);
    defmt::error!("hard fault at {=u32:#x}, called from {=u32:#x}", frame.pc(), frame.lr());
    stop()
}

/// The clock security system: the TMC429 has lost its clock, too.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    make_safe();
    note(CRYSTAL, [0; 3]);
    defmt::error!("the crystal has stopped");
    stop()
}

/// Exceptions and interrupts that nobody expects.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    make_safe();
    note(INTERRUPT, [i32::from(number).cast_unsigned(), 0, 0]);
    defmt::error!("unexpected interrupt {=i16}", number);
    stop()
}

/// Tells why the firmware has started. True after something went wrong; LED2 says so.
pub(super) fn report() -> bool {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // SAFETY: nobody else looks; any bits are a note, and the check tells whether they are one of ours.
    let note = unsafe { core::ptr::read_volatile(NOTE.0.get()).assume_init() };
    // SAFETY: as above.
    unsafe { core::ptr::write_volatile(NOTE.0.get(), MaybeUninit::new(Note { magic: 0, ..note })) };
    // At power-on the memory holds anything.
    let noted = note.magic == MAGIC && note.check == note.check() && !flags.porrstf();
    if noted {
        tell(&note);
    } else if flags.wdgrstf() {
        defmt::error!("restarted by the watchdog: something hung");
    } else if flags.sftrstf() {
        defmt::info!("restarted by command");
    } else {
        defmt::info!("power on");
    }
    let recovering = noted || flags.wdgrstf();
    show_trouble(recovering);
    recovering
}

fn tell(note: &Note) {
    let [a, b, c] = note.details;
    match note.kind {
        PANIC => defmt::error!("restarted after a panic at {=str}:{=u32}", file_name(a, b), c),
        HARD_FAULT => defmt::error!("restarted after a hard fault at {=u32:#x}, called from {=u32:#x}", a, b),
        CRYSTAL => defmt::error!("restarted after the crystal had stopped"),
        _ => defmt::error!("restarted after unexpected interrupt {=i32}", a.cast_signed()),
    }
}

/// A name in the flash, if that is what address and length give.
fn file_name(address: u32, length: u32) -> &'static str {
    const FLASH: core::ops::Range<u32> = 0x0800_0000..0x0810_0000;
    let there = length <= NAME && FLASH.contains(&address) && FLASH.contains(&address.wrapping_add(length));
    if !there {
        return "?";
    }
    // SAFETY: it is all in the flash, which does not change.
    let bytes = unsafe { core::slice::from_raw_parts(address as *const u8, length as usize) };
    core::str::from_utf8(bytes).unwrap_or("?")
}

fn note(kind: u32, details: [u32; 3]) {
    let mut note = Note { magic: MAGIC, kind, details, check: 0 };
    note.check = note.check();
    // SAFETY: interrupts are off.
    unsafe { core::ptr::write_volatile(NOTE.0.get(), MaybeUninit::new(note)) };
}

/// From here on no task and no interrupt handler runs any more, and the motor is without current.
fn make_safe() {
    static ENTERED: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    drivers_off();
    show_trouble(true);
    // Trouble while telling of trouble, as when it began in the middle of a message: say no more.
    if ENTERED.swap(true, Ordering::Relaxed) {
        stop();
    }
}

/// Waits for the watchdog, which leaves a debugger the time to fetch the message.
fn stop() -> ! {
    loop {
        asm::wfi();
    }
}
