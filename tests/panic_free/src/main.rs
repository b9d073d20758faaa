//! An image that links only if nothing in the core can panic. Its panic handler calls a function that does not exist,
//! and everything public of the core is called with values that the compiler cannot know. `tests/image/panic_free.rs`
//! builds it, with the settings of the flash image. It is not meant to be run.

#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod calls;

#[cfg(target_os = "none")]
mod image {
    use core::panic::PanicInfo;

    unsafe extern "C" {
        /// Exists nowhere: a linker that looks for it has met a panic.
        safe fn a_panic_is_possible() -> !;
    }

    #[panic_handler]
    fn panic(info: &PanicInfo) -> ! {
        // What nobody looks at would be left out, and then nothing told where the panic is.
        core::hint::black_box(info);
        a_panic_is_possible()
    }

    /// Where the linker begins to look for what is used.
    // SAFETY: the image has no other function of this name.
    #[unsafe(no_mangle)]
    extern "C" fn _start() {
        super::calls::all();
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!(
        "This is to be linked for a microcontroller, not to be run. `cargo test --test image panic_free` does it."
    );
    std::process::ExitCode::FAILURE
}
