//! Proposals: commands with a reason each.

use std::fmt;

/// A setting that is proposed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Proposal {
    /// The number of the parameter.
    pub parameter: u8,
    /// The axis.
    pub axis: u8,
    /// The value.
    pub value: i32,
    /// Why.
    pub reason: String,
}

impl Proposal {
    fn command(&self) -> String {
        let Proposal { parameter, axis, value, .. } = self;
        format!("SAP {parameter}, {axis}, {value}")
    }
}

/// Writes proposals as lines that a program or a file of settings may have, no wider than `columns`.
pub(super) fn write(out: &mut impl fmt::Write, proposals: &[Proposal], columns: usize) -> fmt::Result {
    let width = proposals.iter().map(|proposal| proposal.command().len()).max().unwrap_or_default();
    let roomy = width + 4 + 30 <= columns;
    for proposal in proposals {
        let command = proposal.command();
        let left = if roomy { width + 1 } else { 4 };
        let mut first = format!("{command:width$} ");
        if !roomy {
            writeln!(out, "{command}")?;
            first = " ".repeat(left);
        }
        for line in wrapped(&proposal.reason, columns.saturating_sub(left + 3).max(8)) {
            writeln!(out, "{first}// {line}")?;
            first = " ".repeat(left);
        }
    }
    Ok(())
}

/// A text in lines of at most `width` characters, as far as its words allow.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_fit_the_terminal() {
        let proposals = [
            Proposal {
                parameter: 174,
                axis: 0,
                value: -10,
                reason: "a reason that takes more than half a line of forty".into(),
            },
            Proposal { parameter: 173, axis: 0, value: 0, reason: "short".into() },
        ];
        let written = |columns| {
            let mut out = String::new();
            write(&mut out, &proposals, columns).unwrap();
            out
        };
        assert_eq!(
            written(80),
            "SAP 174, 0, -10 // a reason that takes more than half a line of forty\nSAP 173, 0, 0   // short\n"
        );
        assert_eq!(
            written(40),
            "SAP 174, 0, -10\n    // a reason that takes more than\n    // half a line of forty\nSAP 173, 0, 0\n    // short\n"
        );
        assert!(written(40).lines().all(|line| line.len() <= 40));
    }

    /// A command of 15 characters stands beside its reason if 4 characters are left for what is between them, and 30
    /// for the reason. Otherwise the reason is below the command, and has all columns but seven.
    #[test]
    fn a_narrow_terminal_has_reasons_below_their_commands() {
        let written = |reason: &str, columns| {
            let mut out = String::new();
            write(&mut out, &[Proposal { parameter: 174, axis: 0, value: -10, reason: reason.into() }], columns)
                .unwrap();
            out
        };
        let (thirty, forty_one) = ("abcde fghij klmno pqrst uvwxyz", "abcdefgh abcdefgh abcdefgh abcdefghi stuv");
        assert_eq!((thirty.len(), forty_one.len()), (30, 41));
        assert_eq!(
            written(&format!("{thirty} x {thirty}"), 49),
            format!(
                "SAP 174, 0, -10 // {thirty}\n                // x abcde fghij klmno pqrst\n                // uvwxyz\n"
            )
        );
        assert_eq!(
            written(&format!("{forty_one} x {forty_one}"), 48),
            format!(
                "SAP 174, 0, -10\n    // {forty_one}\n    // x abcdefgh abcdefgh abcdefgh abcdefghi\n    // stuv\n"
            )
        );
        // A reason has eight characters in a line at least, however narrow the terminal.
        for columns in [0, 5, 15] {
            let lines = "SAP 174, 0, -10\n    // ab cdefg\n    // more\n    // than a\n    // terminal\n";
            assert_eq!(written("ab cdefg more than a terminal", columns), lines, "{columns}");
        }
        assert!(written("ab cdefg more than a terminal", 16).contains("\n    // more than\n"));
    }

    #[test]
    fn lines_have_whole_words() {
        assert!(wrapped("", 10).is_empty());
        assert_eq!(wrapped(" a  bc\nd ", 6), ["a bc d"]);
        assert_eq!(wrapped("a bc d", 5), ["a bc", "d"]);
        assert_eq!(wrapped("a longer one", 3), ["a", "longer", "one"]);
        assert_eq!(wrapped("äöü äöü", 7), ["äöü äöü"], "characters count, and not bytes");
    }
}
