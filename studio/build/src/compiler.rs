//! Facts that the compiler tells of itself.

use std::path::Path;
use std::process::Command;

/// Browsers, in the words of the compiler.
pub const TARGET: &str = "wasm32-unknown-unknown";

/// Tells what the compiler of a workspace says of something when it compiles for browsers, such as of its `sysroot`.
/// The error is one sentence.
pub fn print(workspace: &Path, what: &str) -> Result<String, String> {
    let compiler = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let mut command = Command::new(compiler);
    command.current_dir(workspace).args(["--print", what, "--target", TARGET]);
    run(&mut command).map_err(|why| format!("the compiler does not tell its {what} ({why})"))
}

/// The line that a program prints. The error is what it gives as one.
fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| error.to_string())?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).trim_end().into());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let error = said.lines().find_map(|line| line.strip_prefix("error: "));
    Err(error.map_or_else(|| output.status.to_string(), Into::into))
}
