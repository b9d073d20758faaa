//! What makes a program of the library: the binary of an image has this and nothing else.

/// The image of a firmware: its entry, its memory, and what it does after a panic. A computer gets a stand-in that says what
/// is to be done instead.
///
/// The firmware is a type of `board` with a product, `build` the command that builds the image, and `simulate` the one that
/// runs its core on a computer. The types are looked up for the microcontroller only, since a computer has no `board`.
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
    (firmware: $firmware:ty, build: $build:literal, simulate: $simulate:literal $(,)?) => {
        #[cfg(target_os = "none")]
        mod image {
            #[embassy_executor::main]
            async fn main(spawner: embassy_executor::Spawner) {
                static ROOM: $crate::board::Room<$firmware> = $crate::board::Room::new();
                $crate::board::run(&ROOM, spawner);
            }

            #[panic_handler]
            fn panic(info: &core::panic::PanicInfo) -> ! {
                $crate::board::panicked(info)
            }
        }

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
