//! Differences between two lists of settings.

use super::file::Setting;
use crate::product::Product;

/// The lines that tell what is different, in the order of the first list; what only the second has comes last.
pub fn differences(first: &[Setting], second: &[Setting], product: Option<Product>) -> Vec<String> {
    // A file may have a setting twice; the last line is the one that stays.
    let find = |list: &[Setting], setting: &Setting| list.iter().rev().find(|other| other.is_same(*setting)).copied();
    let mut lines = Vec::new();
    for (index, setting) in first.iter().enumerate() {
        let is_overwritten = first.iter().skip(index + 1).any(|later| later.is_same(*setting));
        let other = find(second, setting);
        if !is_overwritten && other != Some(*setting) {
            lines.push(format!("-{}", setting.line(product)));
            lines.extend(other.map(|other| format!("+{}", other.line(product))));
        }
    }
    for (index, setting) in second.iter().enumerate() {
        let is_overwritten = second.iter().skip(index + 1).any(|later| later.is_same(*setting));
        if !is_overwritten && find(first, setting).is_none() {
            lines.push(format!("+{}", setting.line(product)));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_both_sides_stand_together() {
        let axis = |number, value| Setting::Axis { number, axis: 0, value };
        let first = [axis(4, 1000), axis(5, 7), axis(6, 100), axis(4, 1500)];
        let second = [axis(6, 100), axis(4, 2000), axis(7, 8), axis(7, 9)];
        let lines = differences(&first, &second, None);
        assert_eq!(lines, ["-SAP 5, 0, 7", "-SAP 4, 0, 1500", "+SAP 4, 0, 2000", "+SAP 7, 0, 9"]);
        assert!(differences(&first, &first, None).is_empty());
    }
}
