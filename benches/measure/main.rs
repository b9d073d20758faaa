//! Figures of the flash image on the emulated microcontroller: `cargo measure`.

#[path = "../../tests/common/image.rs"]
mod build;

mod host;
mod profile;
mod symbols;

use std::process::ExitCode;

use host::Failure;
use symbols::Symbols;

fn main() -> ExitCode {
    // Cargo says that this is a benchmark.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match run(&arguments) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("measure: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<ExitCode, Failure> {
    let (output, path) = build::image()?;
    if !output.status.success() {
        return Err(format!("the image does not build\n{}", String::from_utf8_lossy(&output.stderr)).into());
    }
    let elf = std::fs::read(path)?;
    match arguments {
        [what, line] if what == "profile" => profile::run(&elf, &Symbols::read(&elf)?, line)?,
        _ => return Err("usage: cargo measure -- profile \"GAP 5\"".into()),
    }
    Ok(ExitCode::SUCCESS)
}
