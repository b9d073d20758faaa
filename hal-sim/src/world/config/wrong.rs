//! The mistake in an entry of a world file, and the line of the file that has the entry.

use core::fmt;
use toml::de::{DeTable, DeValue};

/// The largest position that a world file may have, so that no sum overflows.
pub(super) const FARTHEST: i64 = 1 << 40;

/// The mistake in an entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Wrong {
    /// The entries that contradict each other, such as `stage.left`. The first is the one to be told of; the others are
    /// where to look if the file does not have that one.
    entries: &'static [&'static str],
    why: String,
}

impl Wrong {
    pub(super) fn new(entries: &'static [&'static str], why: String) -> Self {
        Self { entries, why }
    }

    /// The number, from 1, of the line that has the entry. If the entry is one of an axis, this is in the table of the
    /// axis with this number, or in the tables that all axes have in common.
    pub(super) fn line(&self, text: &str, axis: Option<usize>) -> Option<usize> {
        let file = DeTable::parse(text).ok()?;
        let own = axis.and_then(|axis| match entry(file.get_ref(), "axis")?.1 {
            DeValue::Array(axes) => axes.get(axis)?.get_ref().as_table(),
            _ => None,
        });
        let places = self.entries.iter().flat_map(|name| [own, Some(file.get_ref())].map(|table| (table, name)));
        let found = places.filter_map(|(table, name)| offset(table?, name)).next();
        found.map(|offset| line_at(text, offset))
    }
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.entries.first().copied().unwrap_or_default();
        write!(f, "{name}: {}", self.why)
    }
}

/// Checks the range of a value; NaN is refused.
pub(super) fn within<T: PartialOrd + fmt::Display>(
    name: &'static [&'static str; 1],
    value: T,
    low: T,
    high: T,
) -> Result<(), Wrong> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(Wrong::new(name, format!("{value} is not within {low} to {high}")))
}

/// The number, from 1, of the line that has the byte at offset `offset`.
pub(super) fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

/// The place of an entry such as `stage.left` below a table.
fn offset(table: &DeTable<'_>, path: &str) -> Option<usize> {
    let (name, rest) = path.split_once('.').map_or((path, None), |(name, rest)| (name, Some(rest)));
    let (offset, value) = entry(table, name)?;
    match rest {
        None => Some(offset),
        Some(rest) => self::offset(value.as_table()?, rest),
    }
}

/// An entry of a table: the place of its name, and its value.
fn entry<'a, 'i>(table: &'a DeTable<'i>, name: &str) -> Option<(usize, &'a DeValue<'i>)> {
    let found = table.iter().find(|(key, _)| key.get_ref() == name);
    found.map(|(key, value)| (key.span().start, value.get_ref()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_found_in_each_form_that_toml_has() {
        let wrong = Wrong::new(&["stage.left", "stage.right"], String::new());
        let line = |text: &str, axis| wrong.line(text, axis);
        assert_eq!(line("\n[stage]\nleft = 5", None), Some(3));
        assert_eq!(line("\nstage.left = 5", None), Some(2));
        assert_eq!(line("stage = { right = 1, left = 5 }", None), Some(1));
        // The other entry is told of where the first one is not in the file.
        assert_eq!(line("[stage]\n\nright = 5", None), Some(3));
        // That of the axis comes first, then that of all.
        let text = "[stage]\nleft = 1\n[[axis]]\n[[axis]]\nstage.left = 5\n";
        assert_eq!([None, Some(0), Some(1), Some(7)].map(|axis| line(text, axis)), [2, 2, 5, 2].map(Some));
        assert_eq!(line("[motor]\nstart = 1", None), None);
    }
}
