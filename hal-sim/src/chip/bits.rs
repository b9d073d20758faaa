//! Fields of registers.

/// The field of `bits` bits of a word that begins at bit `low`.
pub(super) fn field(word: u32, low: u32, bits: u32) -> u32 {
    word >> low & ((1 << bits) - 1)
}

/// A two's complement number of `bits` bits.
pub(super) fn sign_extend(value: u32, bits: u32) -> i32 {
    let unused = 32 - bits;
    (value << unused).cast_signed() >> unused
}
