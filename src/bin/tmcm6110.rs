//! The image for the TMCM-6110, on a board of this project. `cargo fw-6110` builds it, `cargo fw-6110-run` brings it there.

#![cfg_attr(target_os = "none", no_std, no_main)]
#![deny(unsafe_code)]

#[cfg(target_os = "none")]
mod image {
    use core::panic::PanicInfo;

    use embassy_executor::Spawner;
    use tmcm::board::{self, AXES, Board, Chips, Room, Tmcl};
    use tmcm::module::Tmcm6110;

    #[embassy_executor::main]
    async fn main(spawner: Spawner) {
        static ROOM: Room<Tmcl<Chips<Tmcm6110>, AXES>> = Room::new();
        board::run(Board::start(), &ROOM, spawner);
    }

    #[panic_handler]
    fn panic(info: &PanicInfo) -> ! {
        board::panicked(info)
    }
}

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    eprintln!(
        "This is the firmware image; a computer cannot run it. `cargo fw-6110` builds it, `cargo sim --image` \
         emulates it, `cargo sim --product 6110` runs its core."
    );
    std::process::ExitCode::FAILURE
}
