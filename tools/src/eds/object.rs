//! An object as an EDS describes it.

use tmcm::canopen::{Access, Initial, Kind, Mapping, Object, ROWS, Row, Type};

/// An object with its index; of those that each PDO has, there is one for each PDO.
#[derive(Clone, Copy, Debug)]
pub struct Described {
    /// The object.
    pub object: Object,
    /// The row of the object in the table.
    pub row: &'static Row,
    /// The number of its PDO, counted from 0; 0 for an object of no PDO.
    pub nth: u8,
}

impl Described {
    /// All objects, in the order of index and sub-index.
    pub fn all() -> Vec<Self> {
        let rows = Object::ALL.iter().zip(&ROWS);
        let mut all: Vec<_> = rows
            .flat_map(|(object, row)| (0..row.count()).map(|nth| Described { object: *object, row, nth }))
            .collect();
        all.sort_by_key(|described| (described.index(), described.row.sub));
        all
    }

    /// The index.
    pub fn index(&self) -> u16 {
        self.row.first + u16::from(self.nth)
    }

    /// The name of the object itself.
    pub fn name(&self) -> String {
        let name = self.row.name.replace('#', &(self.nth + 1).to_string());
        match name.split_once(": ") {
            Some((_, part)) if self.is_head() => {
                let (first, rest) = part.split_at(1);
                first.to_uppercase() + rest
            }
            _ => name,
        }
    }

    /// The name of the index.
    pub fn whole(&self) -> String {
        let name = self.row.name.replace('#', &(self.nth + 1).to_string());
        name.split_once(": ").map(|(whole, _)| whole.into()).unwrap_or(name)
    }

    /// True for sub-index 0 of an array or a record.
    fn is_head(&self) -> bool {
        self.row.kind != Kind::Var && self.row.sub == 0
    }

    /// The access to the object: who may change it, in the words of an EDS. An object that a received PDO may carry is
    /// `rww`; one that is written, but only sent by a PDO, would be `rwr`.
    pub fn access(&self) -> &'static str {
        match (self.row.access, self.row.mapping) {
            (Access::Ro, _) if self.is_constant() => "const",
            (Access::Ro, _) => "ro",
            (Access::Rw, Mapping::No) => "rw",
            (Access::Rw, Mapping::Tx) => "rwr",
            (Access::Rw, Mapping::RxTx) => "rww",
        }
    }

    /// True if the value never changes.
    fn is_constant(&self) -> bool {
        let only = matches!(self.row.ranges, [(low, high)] if low == high);
        only || matches!(
            self.object,
            Object::DeviceType
                | Object::DeviceName
                | Object::HardwareVersion
                | Object::SoftwareVersion
                | Object::VendorId
                | Object::ProductCode
                | Object::RevisionNumber
                | Object::TransmitCompatibility
                | Object::AccelerationDeltaTime
                | Object::DecelerationDeltaTime
                | Object::SupportedModes
        )
    }

    /// True if writing the object is a [command](is_command).
    pub fn is_command(&self) -> bool {
        is_command(self.object)
    }

    /// The smallest and the largest value that a number takes; `None` if it is no number, or is not written.
    pub fn limits(&self) -> Option<(i64, i64)> {
        if self.row.access == Access::Ro || matches!(self.row.data, Type::Text | Type::Octets) {
            return None;
        }
        match (self.row.ranges.first(), self.row.ranges.last()) {
            (Some((low, _)), Some((_, high))) => Some((*low, *high)),
            _ => Some(self.row.data.range()),
        }
    }

    fn is_mapping_entry(&self) -> bool {
        matches!(self.row.first, 0x1600..=0x17FF | 0x1A00..=0x1BFF) && self.row.sub > 0
    }

    /// The value after a factory reset; `None` if it cannot be said beforehand. Without a node ID, a COB-ID that
    /// follows it has it as a variable.
    pub fn default(&self, node: Option<u8>) -> Option<String> {
        let number = |node| self.row.data.value(self.row.default_number(self.nth, node));
        match (self.row.default, node) {
            (Initial::Varies, _) => None,
            (Initial::Text(text), _) => Some(text.into()),
            // The entry of a mapping: an object, in the form of all such entries, or none.
            (_, node) if self.is_mapping_entry() => Some(format!("0x{:08X}", number(node.unwrap_or_default()))),
            (Initial::PlusNode(_), None) => Some(format!("$NODEID+0x{:X}", number(0))),
            (_, node) => Some(shown(number(node.unwrap_or_default()))),
        }
    }
}

/// A number as an EDS has it: large positive ones, which are codes of some kind, in hexadecimal.
pub(super) fn shown(number: i64) -> String {
    if number > 0xFFFF && number != i64::from(i32::MAX) { format!("0x{number:08X}") } else { number.to_string() }
}

/// True if writing an object makes the module do something, so that a value read from it must not be written back.
pub fn is_command(object: Object) -> bool {
    matches!(
        object,
        Object::SaveAll
            | Object::SaveCommunication
            | Object::SaveMotor
            | Object::RestoreAll
            | Object::RestoreCommunication
            | Object::RestoreMotor
            | Object::OsCommand
            | Object::DirectCommunication
            | Object::ManufacturerMode
            | Object::StoreCommunication
    )
}
