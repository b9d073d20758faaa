//! The two copies of a settings page: where they lie, whose they are, and which of them is newer.

use super::memory::{Array, Memory, Storing};
use super::page;

/// Whether the second of two copies is newer than the first, by their epochs and sequence numbers; a copy that is
/// `None` is older than any.
pub(super) fn second_is_newer(copies: [Option<(u16, u8)>; 2]) -> bool {
    match copies {
        [Some((epoch, one)), Some((other_epoch, other))] if epoch == other_epoch => page::follows(other, one),
        [Some((one, _)), Some((other, _))] => page::newer(other, one),
        [one, other] => one.is_none() && other.is_some(),
    }
}

/// True if this is a page of the other firmware.
pub(super) fn is_other<M: Memory>(index: usize, image: &[u8]) -> bool {
    matches!(M::LAYOUT.storing, Storing::Epochs { other, .. } if page::decode(other, index, image, &mut []).is_some())
}

/// Address in the EEPROM of a page's first or second copy. The settings pages fill the EEPROM to its end.
pub(super) fn address<M: Memory>(page: usize, second: bool) -> u16 {
    let area = M::Pairs::LENGTH.saturating_mul(2).saturating_mul(M::PAGE);
    let copy = page.saturating_mul(2).saturating_add(second.into());
    M::SIZE.saturating_sub(area).saturating_add(copy.saturating_mul(M::PAGE)) as u16
}

/// The bit of a page in a set of them.
pub(super) const fn bit(page: usize) -> u64 {
    1_u64.unbounded_shl(page as u32)
}
