//! Tables of numbers, whose decimal points stand below each other.

/// Space between columns, and before the first one.
const GAP: &str = "  ";

/// A line of a table: a unit, a number in each column, and a remark.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Line {
    pub(super) unit: String,
    pub(super) numbers: Vec<String>,
    pub(super) remark: String,
}

/// The text of a table under the names of its columns.
pub(super) fn text(columns: &[&str], lines: &[Line]) -> String {
    let mut table = String::new();
    let width = lines.iter().map(|line| line.unit.chars().count()).max().unwrap_or_default();
    let aligned: Vec<Vec<String>> = (0..columns.len())
        .map(|column| {
            aligned(columns.get(column).copied().unwrap_or_default(), lines.iter().map(|line| number(line, column)))
        })
        .collect();
    for row in 0..=lines.len() {
        let line = row.checked_sub(1).and_then(|row| lines.get(row));
        let mut text = format!("{GAP}{:width$}", line.map_or("", |line| &line.unit));
        for cell in aligned.iter().filter_map(|column| column.get(row)) {
            text = format!("{text}{GAP}{cell}");
        }
        let remark = line.map_or("", |line| &line.remark);
        table += format!("{text}{GAP}{remark}").trim_end();
        table.push('\n');
    }
    table
}

/// A number of a line, if it has one in the column.
fn number(line: &Line, column: usize) -> &str {
    line.numbers.get(column).map_or("", String::as_str)
}

/// A column of equal width, its name first.
fn aligned<'a>(name: &str, numbers: impl Iterator<Item = &'a str>) -> Vec<String> {
    let halves: Vec<(&str, String)> = numbers
        .map(|number| match number.split_once('.') {
            Some((whole, decimals)) => (whole, format!(".{decimals}")),
            None => (number, String::new()),
        })
        .collect();
    let before = halves.iter().map(|(whole, _)| whole.len()).max().unwrap_or_default();
    let behind = halves.iter().map(|(_, decimals)| decimals.len()).max().unwrap_or_default();
    let width = name.len().max(before + behind);
    let numbers =
        halves.iter().map(|(whole, decimals)| format!("{:>width$}", format!("{whole:>before$}{decimals:behind$}")));
    std::iter::once(format!("{name:>width$}")).chain(numbers).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stand_below_each_other() {
        let line = |unit: &str, numbers: &[&str], remark: &str| Line {
            unit: unit.into(),
            numbers: numbers.iter().map(|number| (*number).into()).collect(),
            remark: remark.into(),
        };
        let lines = [line("pps", &["51200", "-1.5"], ""), line("full", &["0.25", "100"], "x"), line("s", &["3"], "y")];
        let expected = "           exact   made\n  pps   51200      -1.5\n  full      0.25  100    x\n  s         3            y\n";
        assert_eq!(text(&["exact", "made"], &lines), expected);
    }
}
