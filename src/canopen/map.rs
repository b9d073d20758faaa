//! Which objects a PDO carries: mapping records, checked and resolved when they are written.

use super::abort::Abort;
use super::object::{Entry, Object};
use super::row::{Mapping, Row};
use super::values::Values;

/// Number of objects that a PDO can carry.
const MOST: usize = 3;
/// Number of PDOs in each direction.
pub(super) const PDOS: u8 = 4;
/// Number of data bytes of a PDO.
const LENGTH: usize = 8;

/// The direction of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Receive,
    Transmit,
}

impl Way {
    /// The object that holds the number of mapped objects.
    const fn mapped(self) -> Object {
        match self {
            Way::Receive => Object::ReceiveMapped,
            Way::Transmit => Object::TransmitMapped,
        }
    }

    /// The objects that hold the mapping entries.
    const fn entries(self) -> [Object; MOST] {
        match self {
            Way::Receive => [Object::ReceiveEntry1, Object::ReceiveEntry2, Object::ReceiveEntry3],
            Way::Transmit => [Object::TransmitEntry1, Object::TransmitEntry2, Object::TransmitEntry3],
        }
    }

    fn carries(self, row: &Row) -> bool {
        match row.mapping {
            Mapping::No => false,
            Mapping::Tx => self == Way::Transmit,
            Mapping::RxTx => true,
        }
    }

    /// The object that a mapping entry names: index, sub-index, and length in bits.
    pub(super) fn mappable(self, entry: u32) -> Result<Entry, Abort> {
        let [bits, sub, low, high] = entry.to_le_bytes();
        let found = Entry::find(u16::from_le_bytes([low, high]), sub).ok();
        let fits = |entry: &Entry| {
            let row = entry.row();
            self.carries(row) && row.data.size().saturating_mul(8) == usize::from(bits)
        };
        found.filter(fits).ok_or(Abort::NotMappable)
    }
}

/// The objects that a PDO carries, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Map {
    entries: [Entry; MOST],
    count: u8,
    /// Number of bytes of all of them.
    pub(super) length: u8,
}

impl Map {
    /// The map of a PDO that carries nothing.
    pub(super) const EMPTY: Self = Map { entries: [Entry::of(Object::DeviceType); MOST], count: 0, length: 0 };

    /// The objects with their sizes in bytes.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Entry, usize)> {
        self.entries.iter().take(self.count.into()).map(|entry| (*entry, entry.row().data.size()))
    }

    /// True for a PDO that carries nothing.
    pub(super) const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The map that a PDO's record says, if the number of mapped objects is `count`.
    ///
    /// # Errors
    /// [`Abort::NotMappable`] or [`Abort::MappingTooLong`].
    pub(super) fn of(values: &Values, way: Way, nth: u8, count: u32) -> Result<Self, Abort> {
        let mut map = Map::EMPTY;
        let wanted = usize::try_from(count).ok().filter(|count| *count <= MOST).ok_or(Abort::MappingTooLong)?;
        let mut length = 0_usize;
        for (place, object) in map.entries.iter_mut().zip(way.entries()).take(wanted) {
            *place = way.mappable(values.get(Entry { object, nth }))?;
            length = length.saturating_add(place.row().data.size());
        }
        if length > LENGTH {
            return Err(Abort::MappingTooLong);
        }
        (map.count, map.length) = (count as u8, length as u8);
        Ok(map)
    }

    /// The map of a PDO by its record as it is.
    pub(super) fn in_force(values: &Values, way: Way, nth: u8) -> Result<Self, Abort> {
        Self::of(values, way, nth, values.get(Entry { object: way.mapped(), nth }))
    }
}

/// Gives PDOs their default mapping where the record says something impossible: a power cut may have left a part of
/// an older one in the EEPROM.
pub(super) fn mend(values: &mut Values, node: u8) {
    for way in [Way::Receive, Way::Transmit] {
        for nth in 0..PDOS {
            if Map::in_force(values, way, nth).is_err() {
                for object in way.entries().into_iter().chain([way.mapped()]) {
                    let entry = Entry { object, nth };
                    values.set(entry, entry.row().default_number(nth, node));
                }
            }
        }
    }
}
