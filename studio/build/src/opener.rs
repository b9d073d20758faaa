//! Opens an address in the browser of whoever sits here.

use std::env;
use std::process::{Command, Stdio};

/// The program that opens an address on this system.
const OPENER: &str = if cfg!(target_os = "macos") {
    "open"
} else if cfg!(windows) {
    "explorer"
} else {
    "xdg-open"
};

/// Opens an address: with the program of the environment variable BROWSER, or with what the system has for that.
///
/// # Errors
/// That program cannot be started; one sentence.
pub fn open(address: &str) -> Result<(), String> {
    let opener = env::var_os("BROWSER").filter(|name| !name.is_empty()).unwrap_or_else(|| OPENER.into());
    let mut command = Command::new(&opener);
    command.arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let started = command.spawn().map(drop);
    started.map_err(|error| {
        format!("{} cannot be started ({error}): open the address above yourself", opener.to_string_lossy())
    })
}
