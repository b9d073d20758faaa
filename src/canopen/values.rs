//! The values of those objects that are settings, in RAM. `entry.rs` writes objects to them.

use super::object::{CELLS, Entry, Object, ROWS};

/// The value of each setting, as [`Type::extend`](super::Type::extend) gives it.
#[derive(Clone, Debug)]
pub(super) struct Values([u32; CELLS]);

impl Values {
    /// The defaults of a node with this ID.
    pub(super) fn of(node: u8) -> Self {
        let mut values = Values([0; CELLS]);
        for entry in entries() {
            values.set(entry, entry.row().default_number(entry.nth, node));
        }
        values
    }

    /// The value of a setting; 0 for a computed object.
    pub(super) fn get(&self, entry: Entry) -> u32 {
        entry.cell().and_then(|cell| self.0.get(cell)).copied().unwrap_or_default()
    }

    /// The value of a setting that no PDO has.
    pub(super) fn of_object(&self, object: Object) -> u32 {
        self.get(Entry::of(object))
    }

    /// Changes the value of a setting; a computed object is ignored.
    pub(super) fn set(&mut self, entry: Entry, value: u32) {
        if let Some(place) = entry.cell().and_then(|cell| self.0.get_mut(cell)) {
            *place = value;
        }
    }
}

/// All objects, those of the PDOs once for each PDO.
pub(super) fn entries() -> impl Iterator<Item = Entry> {
    Object::ALL.iter().zip(&ROWS).flat_map(|(object, row)| {
        let object = *object;
        (0..row.count()).map(move |nth| Entry { object, nth })
    })
}
