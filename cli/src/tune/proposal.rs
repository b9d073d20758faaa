//! What is proposed: commands with a reason each.

use std::io::Write;

use crate::failure::Failure;

/// A setting that is proposed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Proposal {
    /// The number of the parameter.
    pub(super) parameter: u8,
    /// The axis.
    pub(super) axis: u8,
    /// The value.
    pub(super) value: i32,
    /// Why.
    pub(super) reason: String,
}

impl Proposal {
    fn command(&self) -> String {
        let Proposal { parameter, axis, value, .. } = self;
        format!("SAP {parameter}, {axis}, {value}")
    }
}

/// Writes proposals as lines that a program or a file of settings may have, no wider than `columns`.
pub(super) fn write(out: &mut impl Write, proposals: &[Proposal], columns: usize) -> Result<(), Failure> {
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
pub(super) fn wrapped(text: &str, width: usize) -> Vec<String> {
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
            let mut out = Vec::new();
            write(&mut out, &proposals, columns).unwrap();
            String::from_utf8(out).unwrap()
        };
        assert_eq!(
            written(80),
            "SAP 174, 0, -10 // a reason that takes more than half a line of forty\nSAP 173, 0, 0   // short\n"
        );
        assert_eq!(
            written(40),
            "SAP 174, 0, -10\n    // a reason that takes more than\n    // half a line of forty\nSAP 173, 0, 0\n    // short\n"
        );
        // A reason has eight characters in a line at least: "half a" and the word behind it are nine.
        assert!(written(5).contains("\n    // half a\n    // line of\n"), "{}", written(5));
        assert!(written(40).lines().all(|line| line.len() <= 40));
    }
}
