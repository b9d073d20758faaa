//! `cargo fw` builds the flash image, `cargo fw-run` brings it to a module.

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let command = arguments.next().unwrap_or_else(|| "build".into());
    let rest: Vec<String> = arguments.collect();
    if let Err(sentence) = fw::prepare() {
        eprintln!("{sentence}");
        return ExitCode::FAILURE;
    }
    match fw::image_by(&command, &rest).status() {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        // Cargo has said why.
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("cargo cannot be run: {error}");
            ExitCode::FAILURE
        }
    }
}
