//! The macro that makes a program of the library: the binary of an image has this and nothing else.

/// The image of a firmware: its entry, its memory, and what it does after a panic.
///
/// The firmware is a type of `board` with a product, and with user functions if there are any: `docs/own-firmware.md`
/// tells how to write these, in a crate of one's own. The types are looked up for the microcontroller only, since a
/// computer has no `board`.
///
/// `build` is the command that builds the image, and `simulate` the one that runs its core on a computer. With them the
/// computer gets a stand-in that says what is to be done instead.
///
/// ```
/// tmcm::image! {
///     firmware: tmcm::board::Tmcl<tmcm::product::Tmcm1140>,
///     build: "cargo fw",
///     simulate: "cargo sim",
/// }
/// ```
#[macro_export]
macro_rules! image {
    (firmware: $firmware:ty $(,)?) => {
        #[cfg(target_os = "none")]
        const _: () = {
            #[$crate::board::entry]
            fn main() -> ! {
                static ROOM: $crate::board::Room<$firmware> = $crate::board::Room::new();
                $crate::board::run(&ROOM)
            }

            #[panic_handler]
            fn panic(info: &core::panic::PanicInfo) -> ! {
                $crate::board::panicked(info)
            }
        };
    };
    (firmware: $firmware:ty, build: $build:literal, simulate: $simulate:literal $(,)?) => {
        $crate::image! { firmware: $firmware }

        #[cfg(not(target_os = "none"))]
        fn main() -> std::process::ExitCode {
            eprintln!(concat!(
                "This is the firmware image; a computer cannot run it. `",
                $build,
                "` builds it, `cargo sim --image` emulates it, `",
                $simulate,
                "` runs its core."
            ));
            std::process::ExitCode::FAILURE
        }
    };
}
