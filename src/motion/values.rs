//! The values of those parameters of an axis that are settings, without the chips: `parameters.rs` writes settings to
//! them.

use crate::param::{AxisParameter as P, Table};

/// The value of each setting of an axis, in the unit of its row in the parameter table. A product has a part of them
/// only, so those that need no more than a byte have no more.
#[derive(Debug)]
pub struct Values {
    words: [i32; P::WORDS],
    bytes: [u8; P::BYTES],
}

impl Values {
    /// The factory defaults of a parameter table. A setting that the table does not have is 0.
    pub(super) fn of(table: &Table<P>) -> Self {
        let mut values = Values { words: [0; _], bytes: [0; _] };
        for parameter in table.rows {
            values.set(parameter.function, parameter.row.default);
        }
        values
    }

    /// The value of a setting; 0 for a parameter that is not a setting.
    pub(super) fn get(&self, parameter: P) -> i32 {
        let index = parameter.index();
        match self.words.get(index) {
            Some(word) => *word,
            None => self.bytes.get(index.wrapping_sub(P::WORDS)).map_or(0, |byte| (*byte).into()),
        }
    }

    /// True if a setting is other than 0.
    pub(super) fn is_on(&self, parameter: P) -> bool {
        self.get(parameter) != 0
    }

    /// Changes the value of a setting; a parameter that is not a setting is ignored. Of a setting that is 0..=255 on
    /// all products another value counts as the nearest of these.
    pub(super) fn set(&mut self, parameter: P, value: i32) {
        let index = parameter.index();
        if let Some(word) = self.words.get_mut(index) {
            *word = value;
        } else if let Some(byte) = self.bytes.get_mut(index.wrapping_sub(P::WORDS)) {
            *byte = value.clamp(0, u8::MAX.into()) as u8;
        }
    }
}
