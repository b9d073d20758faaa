//! The image for the TMCM-1140 as a node of CANopen. `cargo fw-canopen` builds it, `cargo fw-canopen-run` brings it to a
//! module.

#![cfg_attr(target_os = "none", no_std, no_main)]
#![deny(unsafe_code)]

#[cfg(target_os = "none")]
mod image {
    use core::panic::PanicInfo;

    use embassy_executor::Spawner;
    use tmcm::board::{self, Board, Canopen, Chips, Room};
    use tmcm::canopen::Tmcm1140;

    #[embassy_executor::main]
    async fn main(spawner: Spawner) {
        static ROOM: Room<Canopen<Chips<Tmcm1140>>> = Room::new();
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
        "This is the firmware image; a computer cannot run it. `cargo fw-canopen` builds it, `cargo sim --image` \
         emulates it, `cargo sim --firmware canopen` runs its core."
    );
    std::process::ExitCode::FAILURE
}
