//! A text as the assembler sees it: its parts, its mistakes, and what it has.

use std::ops::Range;
use std::path::Path;

use super::super::assembler::{Watched, assemble_file};
use super::super::diagnostic::{Diagnostic, Diagnostics, Severity};
use super::super::message::Message;
use super::super::statement;
use super::line::each_line;
use super::tokens::{Piece, has_command, pieces};
use crate::product::Product;
use crate::sources::Sources;

/// A text as the assembler sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Examined {
    /// The parts of each line.
    pub lines: Vec<Vec<Piece>>,
    /// The lines that have commands.
    pub commands: Vec<usize>,
    /// The labels.
    pub labels: Vec<Label>,
    /// Errors and warnings of the whole program, those that are shown.
    pub mistakes: Vec<Mistake>,
    /// The sentence for the user where there are more mistakes than are shown.
    pub more: Option<String>,
    /// Number of commands of the whole program, with the STOP that is put at the end; where there are errors, of those
    /// that could be read.
    pub used: usize,
    /// Number of commands that the product has room for; `None` for one that is not known.
    pub room: Option<usize>,
}

/// A label, where it is defined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The label.
    pub name: String,
    /// The line of the label.
    pub line: usize,
}

/// An error or a warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The file; `None` for the text itself.
    pub file: Option<String>,
    /// The line.
    pub line: usize,
    /// The columns of the mistake; they may lie behind the end of the line.
    pub range: Range<usize>,
    /// Whether the program can be assembled all the same.
    pub severity: Severity,
    /// The message about the mistake.
    pub message: Message,
}

/// Examines the text with this name, which may include others, for a product.
///
/// # Errors
/// There is no such text.
pub fn examine(sources: &dyn Sources, main: &Path, product: Option<Product>) -> Result<Examined, String> {
    let text = sources.read(main)?;
    let (mut lines, mut commands, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    let mut skipped = 0;
    each_line(&text, |line| {
        let (defined, tokens) = statement::labels(&line.tokens);
        labels.extend(defined.into_iter().map(|name| Label { name: name.text, line: line.number }));
        if line.problem.is_none() && has_command(tokens) {
            commands.push(line.number);
        }
        lines.push(pieces(&line));
        skipped += line.skipped;
    });
    let Watched { result, used, .. } = assemble_file(sources, main, product);
    let diagnostics = match result {
        Ok(assembly) => assembly.warnings,
        Err(diagnostics) => diagnostics,
    };
    let mistakes = diagnostics.first().iter().map(|diagnostic| mistake(diagnostic, main, skipped)).collect();
    let room = product.map(|product| product.spec().commands.into());
    Ok(Examined { lines, commands, labels, mistakes, more: Diagnostics::more(&diagnostics), used, room })
}

/// A diagnostic of the text with this name and of those that it includes. In front of the text's first line so many
/// units are none of its characters.
fn mistake(diagnostic: &Diagnostic, main: &Path, skipped: usize) -> Mistake {
    let Diagnostic { severity, location, message } = diagnostic;
    let (file, line, range) = match location {
        Some(location) => {
            let file = (Path::new(&location.file) != main).then(|| location.file.clone());
            let skipped = if file.is_none() && location.line == 1 { skipped } else { 0 };
            let [start, end] = [location.column, location.last + 1].map(|column| location.utf16(column) - 1 + skipped);
            (file, location.line.saturating_sub(1), start..end)
        }
        None => (None, 0, 0..0),
    };
    Mistake { file, line, range, severity: *severity, message: message.clone() }
}
