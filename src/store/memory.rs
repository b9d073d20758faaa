//! The facts that a product tells the store: the size of its EEPROM, how the EEPROM is divided, and the values in it.

use core::fmt::Debug;

/// Longest page of an EEPROM that the store can use, in bytes.
pub const LONGEST_PAGE: usize = 128;
/// Most program pages, because each has one bit in the set of pages still to be written.
pub(super) const PROGRAM_PAGES: usize = 1024;
/// Most settings pages, because a `u64` has one bit for each of them.
pub(super) const PAIRS: usize = 64;
/// Bytes of a settings page that hold no values: four bytes of head and four bytes of check sum.
pub(super) const FRAME: usize = 8;

/// First slot that a product may use. The slots below belong to the store itself; they lie in the first settings page,
/// because a factory reset always writes that page.
pub const FIRST_SLOT: usize = 2;

/// An EEPROM and its contents, as types and constants of a product. The program takes the first pages of the EEPROM,
/// the two copies of each settings page take the last ones. Sizes that do not fit each other do not compile:
///
/// ```compile_fail
/// use tmcm::store::{Layout, Memory, Pair, Store, Storing};
///
/// #[derive(Debug)]
/// struct Small;
///
/// impl Memory for Small {
///     const SIZE: usize = 1_024;
///     const PAGE: usize = 64;
///     // 3 * 14 values need three settings pages, but there are two pairs.
///     const LAYOUT: Layout = Layout {
///         tag: b"small",
///         defaults: &[0; 3 * 14],
///         after_erasing: 2,
///         other: 2,
///         storing: Storing::Pages,
///     };
///     type Program = [u8; 448];
///     type Values = [i32; 2 * 14];
///     type Pairs = [Pair; 2];
/// }
///
/// let store = Store::<Small>::new();
/// ```
pub trait Memory: Debug {
    /// Size of the EEPROM in bytes, up to 65 536.
    const SIZE: usize;
    /// Length of a page of the EEPROM in bytes: what one write cycle takes.
    const PAGE: usize;
    /// The slots and their factory defaults.
    const LAYOUT: Layout;
    /// Program memory: an array of bytes, in length a multiple of [`Memory::PAGE`].
    type Program: Array<u8>;
    /// An array of as many values as the settings pages have room for.
    type Values: Array<i32>;
    /// An array with one pair for each settings page.
    type Pairs: Array<Pair>;
}

/// The values that a store keeps, numbered from 0.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Name of the layout. The check sum of each page covers this name, so that pages of another layout count as
    /// foreign.
    pub tag: &'static [u8],
    /// The value of each slot after a factory reset; the first [`FIRST_SLOT`] are the store's own.
    pub defaults: &'static [i32],
    /// The slot that [`Store::erase`](super::Store::erase) sets once the program is erased.
    pub after_erasing: usize,
    /// Number of settings pages of the other known layout for an EEPROM of this size: that of a sister, or of another
    /// firmware. The layout's own number if there is no other one.
    pub other: usize,
    /// How stores are made durable.
    pub storing: Storing,
}

/// How a layout makes what was stored durable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storing {
    /// Each page by itself, as soon as one of its values has changed: a value that is stored is durable after one
    /// write.
    Pages,
    /// All pages in use together, in an epoch of their own that is in force with its last write. So a power cut leaves
    /// all the old values or all the new ones.
    Epochs {
        /// The slot for the number of pages that belong to the epoch. In it is 0 as long as nothing has been stored so.
        pages: usize,
        /// The name of the other firmware's layout. With its first page in place of this one's the settings are its.
        other: &'static [u8],
    },
}

/// An array whose length is a constant of its type.
pub trait Array<T>: AsRef<[T]> + AsMut<[T]> + Debug {
    /// The array of zeros.
    const ZEROS: Self;
    /// Number of elements.
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

/// The knowledge about the two copies of a settings page.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Whether the second copy is the newer one, and the sequence number of the newer copy.
    pub(super) newest: (bool, u8),
    /// How many copies are to be written even if their values are right already, 0..=2.
    pub(super) forced: u8,
    /// The page holds foreign bytes, or is empty although other pages show that it was written once. The first storing
    /// command formats the page by writing both copies.
    pub(super) unformatted: bool,
    /// Epoch and sequence number of each copy as it was loaded, or formatted; `None` for a copy that was foreign or
    /// empty.
    pub(super) found: [Option<(u16, u8)>; 2],
}

impl Pair {
    const NEW: Self = Pair { newest: (false, 0), forced: 0, unformatted: false, found: [None; 2] };
}

/// True when the sizes of a memory fit each other and the EEPROM. Evaluated by the compiler alone, so an overflow in
/// here is a compile error, too.
#[allow(clippy::arithmetic_side_effects)]
pub(super) const fn fits<M: Memory>() -> bool {
    let (program, pairs) = (M::Program::LENGTH, M::Pairs::LENGTH);
    let Layout { defaults, after_erasing, other, storing, .. } = M::LAYOUT;
    let pages = M::PAGE > FRAME
        && M::PAGE <= LONGEST_PAGE
        && M::PAGE.is_multiple_of(4)
        && program.is_multiple_of(M::PAGE)
        && program / M::PAGE <= PROGRAM_PAGES
        && pairs > 0
        && pairs <= PAIRS;
    // The chip takes addresses of 16 bits.
    let part = M::SIZE <= 0x1_0000 && program + 2 * pairs * M::PAGE <= M::SIZE;
    // What is cleared of the other layout holds no program.
    let part = part && other > 0 && other <= PAIRS && program + 2 * other * M::PAGE <= M::SIZE;
    let values = M::Values::LENGTH == pairs * ((M::PAGE - FRAME) / 4);
    let slots = defaults.len() <= M::Values::LENGTH && FIRST_SLOT <= after_erasing && after_erasing < defaults.len();
    // The number of pages is in the first page, whose write is the last of an epoch.
    let slots = slots
        && !matches!(storing, Storing::Epochs { pages, .. } if pages < FIRST_SLOT || (M::PAGE - FRAME) / 4 <= pages);
    pages && part && values && slots
}
