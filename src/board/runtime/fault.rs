//! The reaction when the firmware cannot go on: the motor drivers are switched off, LED2 is lit, the reason is noted,
//! and the watchdog restarts the firmware.
//!
//! A restarted module has lost its position. If it went on as if nothing had happened, it might start its program
//! without any host being told. So it starts without its program, LED2 stays lit until the next good start, and the log
//! says why.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm;
use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac::RCC;

use super::safe::{drivers_off, show_trouble};
use crate::board::stm32f4::kept::Kept;

/// Why the firmware could not go on, kept in RAM through the restart.
#[derive(Clone, Copy)]
#[repr(C)]
struct Note {
    /// [`MAGIC`] in a valid note.
    magic: u32,
    kind: u32,
    /// Details of the note, by its kind: for example addresses, or the place of a panic in the source.
    details: [u32; 3],
    /// The check sum of kind and details, by [`Note::check`].
    check: u32,
}

const MAGIC: u32 = 0x7A11_5E1F;

/// The kinds of notes: a panic, a hard fault, an unexpected interrupt, and a crystal that has stopped.
const PANIC: u32 = 1;
const HARD_FAULT: u32 = 2;
const INTERRUPT: u32 = 3;
const CRYSTAL: u32 = 4;

#[unsafe(link_section = ".uninit.fault")]
static NOTE: Kept<Note> = Kept::new();

/// The longest name of a source file that is taken for valid, in bytes.
const NAME: u32 = 120;

impl Note {
    fn check(&self) -> u32 {
        self.details.iter().fold(!self.kind, |sum, word| sum.rotate_left(5) ^ word)
    }
}

/// Ends the firmware after a panic: to be called by the panic handler.
pub fn panicked(info: &PanicInfo) -> ! {
    make_safe();
    // The name of the source file lies in the flash, so its address is enough to read it after the restart.
    let position = info.location().map_or([0; 3], |at| {
        let file = at.file();
        [file.as_ptr() as u32, file.len() as u32, at.line()]
    });
    note(PANIC, position);
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

/// Called by the clock security system when the crystal stops. The TMC429 has then lost its clock as well.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    make_safe();
    note(CRYSTAL, [0; 3]);
    defmt::error!("the crystal has stopped");
    stop()
}

/// Called for all exceptions and interrupts that have no handler.
#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    make_safe();
    note(INTERRUPT, [i32::from(number).cast_unsigned(), 0, 0]);
    defmt::error!("unexpected interrupt {=i16}", number);
    stop()
}

/// Logs why the firmware has started. True after a fault or a bite of the watchdog, which LED2 shows.
pub(super) fn report() -> bool {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // SAFETY: no other code accesses the note now. Any bits are a `Note`, and its magic number and check sum say if it
    // is valid.
    let note = unsafe { NOTE.read() };
    // SAFETY: as above.
    unsafe { NOTE.write(Note { magic: 0, ..note }) };
    // At power-on the memory may contain anything, so a note counts only after a restart without power-on.
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

/// The file name at an address in the flash, or "?" if address and length do not lie within the flash.
fn file_name(address: u32, length: u32) -> &'static str {
    const FLASH: core::ops::Range<u32> = 0x0800_0000..0x0810_0000;
    let there = length <= NAME && FLASH.contains(&address) && FLASH.contains(&address.wrapping_add(length));
    if !there {
        return "?";
    }
    // SAFETY: all these bytes are in the flash, which does not change.
    let bytes = unsafe { core::slice::from_raw_parts(address as *const u8, length as usize) };
    core::str::from_utf8(bytes).unwrap_or("?")
}

fn note(kind: u32, details: [u32; 3]) {
    let mut note = Note { magic: MAGIC, kind, details, check: 0 };
    note.check = note.check();
    // SAFETY: interrupts are off, so no other code accesses the note.
    unsafe { NOTE.write(note) };
}

/// Ends all tasks and interrupt handlers, and takes the current from the motor.
fn make_safe() {
    static ENTERED: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    drivers_off();
    show_trouble(true);
    // A second fault, while the first one was being logged, is not logged: the first may have begun within a log
    // message.
    if ENTERED.swap(true, Ordering::Relaxed) {
        stop();
    }
}

/// Waits for the watchdog. That leaves a debugger time to fetch the log message.
fn stop() -> ! {
    loop {
        asm::wfi();
    }
}
