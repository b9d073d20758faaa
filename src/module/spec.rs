//! What a product is, as data.

/// A product: everything in which one module differs from its sisters and that is not an algorithm.
#[derive(Debug)]
pub struct Spec {
    /// Four characters of the version string.
    pub name: [u8; 4],
    /// Number in the binary version reply.
    pub number: u16,
    /// Major version.
    pub major: u8,
    /// Minor version.
    pub minor: u8,
    /// General purpose digital outputs.
    pub outputs: u8,
}

/// Axes of the TMCM-1140.
pub const TMCM_1140_AXES: usize = 1;

/// The TMCM-1140 with its TMCL firmware; the version is that of the manual this firmware follows.
pub static TMCM_1140: Spec = Spec { name: *b"1140", number: 1140, major: 1, minor: 42, outputs: 2 };

impl Spec {
    /// The version string of command 136, type 0: `1140V142`.
    pub fn version_string(&self) -> [u8; 8] {
        let digit = |n: u8| b'0'.saturating_add(n % 10);
        let [a, b, c, d] = self.name;
        [a, b, c, d, b'V', digit(self.major), digit(self.minor / 10), digit(self.minor)]
    }

    /// The version number of command 136, type 1: module number in the upper half, then major and minor.
    pub const fn version_number(&self) -> i32 {
        let [high, low] = self.number.to_be_bytes();
        i32::from_be_bytes([high, low, self.major, self.minor])
    }
}
