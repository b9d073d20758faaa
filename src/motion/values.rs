//! The values of those parameters of an axis that are settings, without the chips: `parameters.rs` writes settings to
//! them.

use crate::param::{AxisParameter as P, Table};

/// The value of each setting of an axis, in the unit of its row in the parameter table.
#[derive(Debug)]
pub struct Values([i32; P::SETTINGS]);

impl Values {
    /// The factory defaults of a parameter table. A setting that the table does not have is 0.
    pub(super) fn of(table: &Table<P>) -> Self {
        Values(table.defaults())
    }

    /// The value of a setting; 0 for a parameter that is not a setting.
    pub(super) fn get(&self, parameter: P) -> i32 {
        self.0.get(parameter.index()).copied().unwrap_or_default()
    }

    /// True if a setting is other than 0.
    pub(super) fn is_on(&self, parameter: P) -> bool {
        self.get(parameter) != 0
    }

    /// Changes the value of a setting; a parameter that is not a setting is ignored.
    pub(super) fn set(&mut self, parameter: P, value: i32) {
        if let Some(entry) = self.0.get_mut(parameter.index()) {
            *entry = value;
        }
    }
}
