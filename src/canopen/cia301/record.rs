//! The records of PDOs (1400h to 1A03h): communication and mapping parameters.

use super::cob;
use crate::units::Micros;

/// Number of objects that a PDO can carry.
pub(super) const MOST: usize = 3;

/// The direction of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The node receives it.
    Receive,
    /// The node sends it.
    Transmit,
}

/// The record of a PDO, as its objects have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Record {
    pub(crate) cob_id: u32,
    /// The transmission type.
    pub(crate) kind: u8,
    /// How long the PDO is not sent again.
    pub(crate) inhibit: Micros,
    /// The time after which it is sent again; 0 for none.
    pub(crate) timer: Micros,
    /// Number of mapped objects, of the entries that follow.
    pub(crate) count: u8,
    pub(crate) entries: [u32; MOST],
}

/// A field of a PDO's record that a master writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// The COB-ID.
    CobId,
    /// The transmission type.
    Type,
    /// Inhibit time, or event timer.
    Time,
    /// Number of mapped objects.
    Count,
    /// A mapping entry.
    Entry,
}

impl Record {
    /// True while the PDO is on.
    pub(super) const fn is_valid(&self) -> bool {
        self.cob_id & cob::OFF == 0
    }

    /// The CAN identifier; `None` while the PDO is off.
    pub(super) const fn id(&self) -> Option<u16> {
        if self.is_valid() { Some(cob::can_id(self.cob_id)) } else { None }
    }
}
