//! Columns of a line in characters, as the assembler counts, and in units of UTF-16, as editors do.

use std::ops::Range;

use super::super::source::Span;

/// The columns of a line.
#[derive(Debug)]
pub(super) struct Columns {
    /// For each character its first unit, and the end of the line; `None` where every character is one unit.
    units: Option<Vec<usize>>,
    /// Number of units in front of the line that are none of its characters.
    skipped: usize,
}

impl Columns {
    /// The columns of a line in front of which so many units are none of its characters.
    pub(super) fn of(text: &str, skipped: usize) -> Self {
        let units = (!text.is_ascii()).then(|| {
            let mut at = 0;
            let starts = text.chars().map(|character| {
                at += character.len_utf16();
                at
            });
            [0].into_iter().chain(starts).collect()
        });
        Columns { units, skipped }
    }

    /// The unit at which a character begins. Behind the end of the line each character is one unit.
    pub(super) fn unit(&self, character: usize) -> usize {
        let unit = self.units.as_ref().map_or(character, |units| match units.get(character) {
            Some(unit) => *unit,
            None => units.last().map_or(0, |end| end + character + 1 - units.len()),
        });
        unit + self.skipped
    }

    /// The character to which a unit belongs.
    pub(super) fn character(&self, unit: usize) -> usize {
        let unit = unit.saturating_sub(self.skipped);
        self.units.as_ref().map_or(unit, |units| match units.last() {
            Some(end) if unit > *end => units.len() - 1 + unit - end,
            _ => units.partition_point(|start| *start <= unit).saturating_sub(1),
        })
    }

    /// A part of the line in units.
    pub(super) fn range(&self, span: Span) -> Range<usize> {
        self.unit(span.start)..self.unit(span.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_have_one_unit_or_two() {
        let columns = Columns::of("aü😀b", 0);
        assert_eq!([0, 1, 2, 3, 4, 5, 7].map(|character| columns.unit(character)), [0, 1, 2, 4, 5, 6, 8]);
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 8].map(|unit| columns.character(unit)), [0, 1, 2, 2, 3, 4, 5, 7]);
        let plain = Columns::of("ab", 1);
        assert_eq!((plain.range(Span::new(0, 2)), plain.character(0), plain.character(3)), (1..3, 0, 2));
    }
}
