//! Builds what runs on the microcontroller.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const TARGET: &str = "thumbv7em-none-eabi";
const PACKAGE: &str = "tmcm";
const IMAGE: &str = "tmcm1140";

/// Builds the flash image; where it is.
pub(crate) fn image() -> io::Result<(Output, PathBuf)> {
    build(IMAGE, &["--package", PACKAGE, "--bin", IMAGE])
}

/// Builds a program by `cargo rustc`, into the build directory of this very test; what is there already is not built
/// again. The build directory is free while tests run. Flags meant for the host's compiler are left out.
pub(crate) fn build(name: &str, arguments: &[&str]) -> io::Result<(Output, PathBuf)> {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("..");
    let output = Command::new(env!("CARGO"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["rustc", "--release", "--color=never", "--target", TARGET, "--target-dir"])
        .arg(&directory)
        .args(arguments)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .output()?;
    Ok((output, directory.join(TARGET).join("release").join(name)))
}
