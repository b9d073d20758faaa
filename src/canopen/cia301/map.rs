//! The objects that a PDO carries: mapping records, checked and resolved when they are written.

use super::abort::Abort;
use super::record::{Direction, Field, MOST, Record};
use super::{Description, Mapping, cob};

/// Number of data bytes of a PDO.
const LENGTH: usize = 8;

/// An object that a PDO carries.
#[derive(Clone, Copy, Debug)]
struct Mapped<E> {
    entry: E,
    /// Size of the object in bytes.
    size: u8,
}

/// The objects that a PDO carries, in their order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Map<E> {
    mapped: [Option<Mapped<E>>; MOST],
    /// Number of bytes of all of them.
    pub(super) length: u8,
}

impl<E: Copy> Map<E> {
    /// The map of a PDO that carries nothing.
    pub(super) const EMPTY: Self = Map { mapped: [None; MOST], length: 0 };

    /// The map that a PDO's record says. `find` gives the object with an index and a sub-index.
    ///
    /// # Errors
    /// [`Abort::NotMappable`] or [`Abort::MappingTooLong`].
    pub(crate) fn of(
        record: &Record,
        direction: Direction,
        find: impl Fn(u16, u8) -> Result<(E, Description), Abort>,
    ) -> Result<Self, Abort> {
        let mut map = Map::EMPTY;
        let count = usize::from(record.count);
        if count > MOST {
            return Err(Abort::MappingTooLong);
        }
        let mut length = 0_usize;
        for (place, entry) in map.mapped.iter_mut().zip(record.entries).take(count) {
            let mapped = mappable(entry, direction, &find)?;
            length = length.saturating_add(mapped.size.into());
            *place = Some(mapped);
        }
        if length > LENGTH {
            return Err(Abort::MappingTooLong);
        }
        map.length = length as u8;
        Ok(map)
    }

    /// The map of the record that a master asks for by writing to a field of it, given the record as it is and the one
    /// that is asked for.
    ///
    /// # Errors
    /// [`Abort::Access`] where the PDO is valid, unless it may be changed by `force`; or the value is impossible.
    pub(crate) fn admitted(
        direction: Direction,
        field: Field,
        (before, after): (&Record, &Record),
        written: u32,
        force: bool,
        find: impl Fn(u16, u8) -> Result<(E, Description), Abort>,
    ) -> Result<Self, Abort> {
        let fixed = match field {
            Field::CobId => {
                cob::pdo(written)?;
                before.is_valid() && after.is_valid() && before.id() != after.id()
            }
            Field::Count => before.is_valid(),
            Field::Entry => before.is_valid() || before.count != 0,
            Field::Type | Field::Time => false,
        };
        if fixed && !force {
            return Err(Abort::Access);
        }
        // 0 maps nothing.
        if field == Field::Entry && written != 0 {
            mappable(written, direction, &find)?;
        }
        Self::of(after, direction, find)
    }

    /// True for a PDO that carries nothing.
    pub(super) const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// The objects, each with the bytes that stand for it in the data of a PDO, and whatever follows them.
    pub(crate) fn unpacked(&self, data: [u8; 8]) -> impl Iterator<Item = (E, u32)> {
        let mut rest = u64::from_le_bytes(data);
        self.mapped.iter().flatten().map(move |mapped| {
            let number = rest as u32;
            rest = rest.unbounded_shr(bits(mapped.size));
            (mapped.entry, number)
        })
    }

    /// The data of a PDO: the objects as `read` gives them. Never inlined, because there are three who want them.
    #[inline(never)]
    pub(super) fn packed(&self, read: &impl Fn(E) -> u32) -> [u8; 8] {
        let (mut data, mut shift) = (0_u64, 0_u32);
        for Mapped { entry, size } in self.mapped.iter().flatten() {
            let number = u64::from(read(*entry)) & !u64::MAX.unbounded_shl(bits(*size));
            data |= number.unbounded_shl(shift);
            shift = shift.saturating_add(bits(*size));
        }
        data.to_le_bytes()
    }
}

/// The object that a mapping entry names: index, sub-index, and length in bits.
///
/// # Errors
/// [`Abort::NotMappable`].
fn mappable<E>(
    entry: u32,
    direction: Direction,
    find: impl Fn(u16, u8) -> Result<(E, Description), Abort>,
) -> Result<Mapped<E>, Abort> {
    let [length, sub, low, high] = entry.to_le_bytes();
    let (entry, Description { size, mapping, .. }) =
        find(u16::from_le_bytes([low, high]), sub).map_err(|_| Abort::NotMappable)?;
    let carried = match mapping {
        Mapping::No => false,
        Mapping::Tx => direction == Direction::Transmit,
        Mapping::RxTx => true,
    };
    if carried && bits(size) == u32::from(length) { Ok(Mapped { entry, size }) } else { Err(Abort::NotMappable) }
}

const fn bits(size: u8) -> u32 {
    (size as u32).wrapping_mul(8)
}
