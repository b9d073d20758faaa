//! What a store is made for: an EEPROM of a size, how it is divided, and the values in it.

use core::fmt::Debug;

/// Bytes of the longest page that a part may have.
pub const LONGEST_PAGE: usize = 128;
/// Program pages that can be told apart.
pub(super) const PROGRAM_PAGES: usize = 1024;
/// Pairs of settings pages that can be told apart.
pub(super) const PAIRS: usize = 64;
/// Bytes of a settings page that hold no values: four of head and four of check sum.
pub(super) const FRAME: usize = 8;

/// The first slots are the store's own; they are in the first page, which a factory reset writes.
pub const FIRST_SLOT: usize = 2;

/// An EEPROM and its contents, as types and constants of a product. The program takes the first pages; behind it each page of
/// settings has two pages of the part. What does not fit does not compile:
///
/// ```compile_fail
/// use tmcm::store::{Layout, Memory, Pair, Store};
///
/// #[derive(Debug)]
/// struct Small;
///
/// impl Memory for Small {
///     const SIZE: usize = 1_024;
///     const PAGE: usize = 64;
///     // Three pages would be needed, but there are two pairs.
///     const LAYOUT: Layout = Layout { tag: b"small", defaults: &[0; 3 * 14], after_erasing: 2 };
///     type Program = [u8; 448];
///     type Values = [i32; 2 * 14];
///     type Pairs = [Pair; 2];
/// }
///
/// let store = Store::<Small>::new();
/// ```
pub trait Memory: Debug {
    /// Bytes in the EEPROM.
    const SIZE: usize;
    /// Bytes in a page of the EEPROM: what is written at once.
    const PAGE: usize;
    /// The values.
    const LAYOUT: Layout;
    /// Program memory, whole pages: an array of bytes.
    type Program: Array<u8>;
    /// As many values as the pages of settings have room for.
    type Values: Array<i32>;
    /// One for each page of settings.
    type Pairs: Array<Pair>;
}

/// The values that a store keeps, numbered from 0.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Goes into the check sum of each page, so that pages of another layout count as foreign.
    pub tag: &'static [u8],
    /// The value of each slot after a factory reset; the first [`FIRST_SLOT`] are the store's own.
    pub defaults: &'static [i32],
    /// The slot that gets its value when a program has been erased.
    pub after_erasing: usize,
}

/// An array of any length.
pub trait Array<T>: AsRef<[T]> + AsMut<[T]> + Debug {
    /// All zeros.
    const ZEROS: Self;
    /// Its length.
    const LENGTH: usize;
}

impl<const N: usize> Array<u8> for [u8; N] {
    const ZEROS: Self = [0; N];
    const LENGTH: usize = N;
}

impl<const N: usize> Array<i32> for [i32; N] {
    const ZEROS: Self = [0; N];
    const LENGTH: usize = N;
}

impl<const N: usize> Array<Pair> for [Pair; N] {
    const ZEROS: Self = [Pair::NEW; N];
    const LENGTH: usize = N;
}

/// What is known of the two copies of a page of settings.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Whether the second copy is the newest, and the sequence number of the newest.
    pub(super) newest: (bool, u8),
    /// How many copies are to be written whatever is in them.
    pub(super) forced: u8,
    /// The page holds something which is not ours, or nothing where there should be something. The first store writes over
    /// it; it is ours when both copies are written.
    pub(super) alien: bool,
    /// Epoch and sequence number of each copy as it was loaded, if it was ours.
    pub(super) found: [Option<(u16, u8)>; 2],
}

impl Pair {
    const NEW: Self = Pair { newest: (false, 0), forced: 0, alien: false, found: [None; 2] };
}

/// Whether the parts of a memory agree with each other and with the EEPROM: for the compiler, which stops where it cannot
/// reckon on.
#[allow(clippy::arithmetic_side_effects)]
pub(super) const fn fits<M: Memory>() -> bool {
    let (program, pairs) = (M::Program::LENGTH, M::Pairs::LENGTH);
    let Layout { defaults, after_erasing, .. } = M::LAYOUT;
    let pages = M::PAGE > FRAME
        && M::PAGE <= LONGEST_PAGE
        && M::PAGE.is_multiple_of(4)
        && program.is_multiple_of(M::PAGE)
        && program / M::PAGE <= PROGRAM_PAGES
        && pairs > 0
        && pairs <= PAIRS;
    // Addresses have 16 bits.
    let part = M::SIZE <= 0x1_0000 && program + 2 * pairs * M::PAGE <= M::SIZE;
    let values = M::Values::LENGTH == pairs * ((M::PAGE - FRAME) / 4);
    let slots = defaults.len() <= M::Values::LENGTH && FIRST_SLOT <= after_erasing && after_erasing < defaults.len();
    pages && part && values && slots
}
