//! Stands in for the crate `cbor-edn`, by which `defmt-decoder` prints what a log has with the display hint `:cbor`. No
//! message of this firmware has that hint, so nothing of CBOR is known here: the bytes are printed in hexadecimal.
//!
//! That crate needs `chrono` with what this asks of its surroundings. In a browser these are functions of JavaScript by
//! `wasm-bindgen`, which a page without that tool does not have. In a program that is linked for macOS on another
//! system, these are a framework that is not there. The `[patch]` in `Cargo.toml` of the workspace puts this in its
//! place.

#![forbid(unsafe_code)]

use std::convert::Infallible;
use std::fmt::Write;

/// Values of CBOR, one behind the other.
#[derive(Clone, Copy, Debug)]
pub struct Sequence<'a>(&'a [u8]);

impl<'a> Sequence<'a> {
    /// The values that these bytes are.
    ///
    /// # Errors
    /// None: the bytes are not looked at.
    pub fn from_cbor(bytes: &'a [u8]) -> Result<Self, Infallible> {
        Ok(Sequence(bytes))
    }

    /// The values as text, such as `CBOR 83 01 02 03`.
    pub fn serialize(&self) -> String {
        self.0.iter().fold("CBOR".into(), |mut text, byte| {
            // A string takes whatever is written.
            let _ = write!(text, " {byte:02x}");
            text
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_printed_in_hexadecimal() {
        let Ok(sequence) = Sequence::from_cbor(&[0x83, 1, 0xa, 0xff]);
        assert_eq!(sequence.serialize(), "CBOR 83 01 0a ff");
    }
}
