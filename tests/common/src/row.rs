//! A row of the tables that are typed independently of the firmware's own: a parameter as its manual has it.

/// A parameter as its manual has it.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Number of the parameter.
    pub number: u8,
    /// Name of the parameter.
    pub name: &'static str,
    /// Inclusive ranges of the accepted values.
    pub ranges: &'static [(i32, i32)],
    /// Access and storage.
    pub kind: Kind,
}

/// Access and storage of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Can be read, written and stored in the EEPROM; with the value after a factory reset.
    Stored(i32),
    /// A setting in RAM only, which reads as it was written; with the value after power-on.
    Kept(i32),
    /// Can be read and written, in RAM only, but may change by itself; with the value after power-on.
    Volatile(i32),
    /// A measured or computed value that can only be read.
    ReadOnly,
}

impl Row {
    /// True if the value is in one of the ranges.
    pub fn accepts(&self, value: i32) -> bool {
        self.ranges.iter().any(|range| (range.0..=range.1).contains(&value))
    }

    /// True if the parameter can be written.
    pub fn is_writable(&self) -> bool {
        self.kind != Kind::ReadOnly
    }

    /// True if the value can be stored in the EEPROM.
    pub fn is_stored(&self) -> bool {
        matches!(self.kind, Kind::Stored(_))
    }

    /// True for a parameter that reads as it was written until it is written again.
    pub fn is_setting(&self) -> bool {
        matches!(self.kind, Kind::Stored(_) | Kind::Kept(_))
    }

    /// The value after a factory reset; `None` for a read-only parameter.
    pub fn default(&self) -> Option<i32> {
        match self.kind {
            Kind::Stored(value) | Kind::Kept(value) | Kind::Volatile(value) => Some(value),
            Kind::ReadOnly => None,
        }
    }

    /// The lowest and the highest value of every range.
    pub fn limits(&self) -> impl Iterator<Item = i32> {
        self.ranges.iter().flat_map(|range| [range.0, range.1])
    }

    /// The values just outside the ranges, and the smallest and largest 32-bit values if they lie outside.
    pub fn beyond(&self) -> impl Iterator<Item = i32> {
        let next = self.ranges.iter().flat_map(|range| [range.0.checked_sub(1), range.1.checked_add(1)]);
        next.flatten().chain([i32::MIN, i32::MAX]).filter(|value| !self.accepts(*value))
    }

    /// An accepted value other than the default.
    pub fn another(&self) -> i32 {
        self.limits().find(|value| Some(*value) != self.default()).unwrap()
    }
}

pub(super) const ANY: &[(i32, i32)] = &[(i32::MIN, i32::MAX)];
pub(super) const FLAG: &[(i32, i32)] = &[(0, 1)];

pub(super) const fn stored(number: u8, name: &'static str, ranges: &'static [(i32, i32)], default: i32) -> Row {
    Row { number, name, ranges, kind: Kind::Stored(default) }
}

pub(super) const fn kept(number: u8, name: &'static str, ranges: &'static [(i32, i32)], default: i32) -> Row {
    Row { number, name, ranges, kind: Kind::Kept(default) }
}

pub(super) const fn volatile(number: u8, name: &'static str, ranges: &'static [(i32, i32)], default: i32) -> Row {
    Row { number, name, ranges, kind: Kind::Volatile(default) }
}

pub(super) const fn read_only(number: u8, name: &'static str, ranges: &'static [(i32, i32)]) -> Row {
    Row { number, name, ranges, kind: Kind::ReadOnly }
}
