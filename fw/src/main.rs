//! `cargo fw` builds the flash image, `cargo fw-run` brings it to a module; `cargo fw-canopen` and `cargo fw-canopen-run`
//! do so with that of the CANopen firmware, `cargo fw-6110` and `cargo fw-6110-run` with that of the TMCM-6110, `cargo
//! fw-3212` and `cargo fw-3212-run` with that of the TMCM-3212.

use std::os::unix::process::CommandExt;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let image = arguments.next().unwrap_or_else(|| fw::TMCL.into());
    let command = arguments.next().unwrap_or_else(|| "build".into());
    let rest: Vec<String> = arguments.collect();
    let error = match fw::prepare().and_then(|()| fw::image_by(&command, &image, &rest)) {
        // Cargo takes this process over, and is its end.
        Ok(mut cargo) => format!("cargo cannot be run: {}", cargo.exec()),
        Err(sentence) => sentence,
    };
    eprintln!("{error}");
    ExitCode::FAILURE
}
