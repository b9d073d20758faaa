//! The report, which is printed, and written to the page of the documentation: Markdown.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;

use super::host::Failure;

/// Lines of the page between which the tables stand.
const BEGIN: &str = "<!-- cargo measure -->";
const END: &str = "<!-- end of cargo measure -->";

/// All that has been printed.
#[derive(Default)]
pub(crate) struct Report(String);

impl Report {
    /// Begins a section.
    pub(crate) fn title(&mut self, title: &str) {
        self.print(&format!("### {title}\n\n"));
    }

    /// A paragraph.
    pub(crate) fn text(&mut self, text: &str) {
        self.print(&format!("{text}\n\n"));
    }

    /// A table, its columns as wide as they have to be.
    pub(crate) fn table<const N: usize>(&mut self, head: [&str; N], rows: &[[String; N]]) {
        let head = head.map(str::to_owned);
        let width = |column: usize| {
            let cells = rows.iter().chain([&head]).map(|row| row[column].chars().count());
            cells.max().unwrap_or_default().max(3)
        };
        let widths: [usize; N] = std::array::from_fn(width);
        let rule: [String; N] = std::array::from_fn(|column| {
            let dashes = "-".repeat(widths[column] - usize::from(column > 0));
            if column > 0 { dashes + ":" } else { dashes }
        });
        let mut text = String::new();
        for row in [&head, &rule].into_iter().chain(rows) {
            for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                // Numbers to the right.
                let _ = if column == 0 { write!(text, "| {cell:width$} ") } else { write!(text, "| {cell:>width$} ") };
            }
            text.push_str("|\n");
        }
        text.push('\n');
        self.print(&text);
    }

    fn print(&mut self, text: &str) {
        print!("{text}");
        self.0.push_str(text);
    }

    /// Puts it into the page at `path`, in place of what is there.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let page = std::fs::read_to_string(path)?;
        let parts = page.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
        let (before, after) = parts.ok_or_else(|| format!("{} has no place for the tables", path.display()))?;
        std::fs::write(path, format!("{before}{BEGIN}\n\n{}{END}{after}", self.0))?;
        Ok(())
    }
}

/// Tells what is going on, and the time since the first such message.
pub(crate) fn progress(what: &str) {
    static START: OnceLock<Instant> = OnceLock::new();
    eprintln!("measure: {:3.0} s: {what}", START.get_or_init(Instant::now).elapsed().as_secs_f64());
}
