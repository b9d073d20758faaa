//! The values of an axis' parameters.

use crate::param::{AxisParameter as P, Table};

/// The values of those axis parameters that are settings, as they were set.
#[derive(Debug)]
pub struct Values([i32; P::SETTINGS]);

impl Values {
    /// The factory defaults of a table. What it does not have is 0.
    pub(super) fn of(table: &Table<P>) -> Self {
        Values(table.defaults())
    }

    /// The value of a setting; 0 of what is none.
    pub(super) fn get(&self, parameter: P) -> i32 {
        self.0.get(parameter.index()).copied().unwrap_or_default()
    }

    /// True if a setting is other than 0.
    pub(super) fn is_on(&self, parameter: P) -> bool {
        self.get(parameter) != 0
    }

    /// Sets a setting.
    pub(super) fn set(&mut self, parameter: P, value: i32) {
        if let Some(place) = self.0.get_mut(parameter.index()) {
            *place = value;
        }
    }
}
