//! Builds flash images into the build directory of this test, whose lock is free while tests run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

pub use xtask::Built;

/// Builds the flash image and returns its path. Panics if the image cannot be built.
pub fn image() -> PathBuf {
    built(xtask::TMCL)
}

/// Builds the flash image of the CANopen firmware and returns its path. Panics if the image cannot be built.
pub fn canopen() -> PathBuf {
    built(xtask::CANOPEN)
}

/// Builds the flash image of the TMCM-6110 and returns its path. Panics if the image cannot be built.
pub fn six_axes() -> PathBuf {
    built("tmcm6110")
}

/// Builds the flash image of the TMCM-3212 and returns its path. Panics if the image cannot be built.
pub fn three_axes() -> PathBuf {
    built("tmcm3212")
}

/// An image of which all tests of a process know, once it was built: asking Cargo again takes longer than many a test.
fn built(name: &str) -> PathBuf {
    static BUILT: Mutex<BTreeMap<String, PathBuf>> = Mutex::new(BTreeMap::new());
    let mut built = BUILT.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let build = || try_built(name).unwrap_or_else(|error| panic!("{error}")).path;
    built.entry(name.to_owned()).or_insert_with(build).clone()
}

/// Builds a flash image by its name; returns its path and the compiler's messages, or an error message.
pub fn try_built(name: &str) -> Result<Built, String> {
    xtask::image(&directory(), name)
}

/// Builds another program for the microcontroller with these arguments of cargo; the error is a message.
pub fn build(name: &str, arguments: &[&str]) -> Result<Built, String> {
    xtask::build(&directory(), name, arguments)
}

/// Builds a program whose workspace is another folder; the error is a message.
pub fn build_in(folder: &Path, name: &str) -> Result<Built, String> {
    xtask::build_in(folder, &directory(), name, &[])
}

fn directory() -> PathBuf {
    xtask::programs().unwrap_or_else(|error| panic!("{error}")).join("..")
}
