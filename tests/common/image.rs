//! Builds what runs on the microcontroller, into the build directory of this very test, which is free while tests run.

#![allow(dead_code, clippy::panic)]

use std::path::{Path, PathBuf};

pub(crate) use fw::Built;

/// The flash image; where it is. Panics if it cannot be built.
pub(crate) fn image() -> PathBuf {
    try_image().unwrap_or_else(|error| panic!("{error}")).path
}

/// The flash image, and what the compiler said; the error says why not.
pub(crate) fn try_image() -> Result<Built, String> {
    fw::image(&directory())
}

/// A program of its own; the error says why not.
pub(crate) fn build(name: &str, arguments: &[&str]) -> Result<Built, String> {
    fw::build(&directory(), name, arguments)
}

fn directory() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("..")
}
