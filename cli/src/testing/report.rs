//! The output of a run that the user sees: a line for each scenario, a bar while they run, and at the end the failures.

use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use tmcm_sim::scenario::suite::{News, Outcome, Report};

use crate::failure::Failure;
use crate::progress::Progress;
use crate::tell;

/// Prints what happens.
pub(super) struct Printer {
    /// Standard output has the report for other programs, so the lines go to standard error.
    beside: bool,
    /// The bar, where standard error is a terminal.
    progress: Option<Progress>,
    /// The outcome of the printing so far. Scenarios go on when nobody reads the lines, because of the report.
    printed: io::Result<()>,
}

impl Printer {
    pub(super) fn new(beside: bool) -> Self {
        Printer { beside, progress: None, printed: Ok(()) }
    }

    /// Tells of what has just been done.
    pub(super) fn tell(&mut self, news: &News<'_>) {
        match news {
            News::Cases(done, total) => {
                if io::stderr().is_terminal() {
                    self.progress.get_or_insert_with(|| Progress::new("running", *total)).reach(*done);
                }
            }
            News::Scenario(report) => {
                if let Some(progress) = &mut self.progress {
                    progress.pause();
                }
                self.print(&format!("{}: {} ... {}", report.file, report.title, report.verdict()));
            }
        }
    }

    fn print(&mut self, line: &str) {
        if self.printed.is_ok() {
            self.printed = if self.beside {
                // A closed standard error does not end the program.
                let _ = writeln!(tell::err(), "{line}");
                Ok(())
            } else {
                writeln!(tell::out(), "{line}")
            };
        }
    }

    /// Prints the failures and how many cases have passed. True if none has failed.
    pub(super) fn finish(mut self, reports: &[Report], took: Duration) -> Result<bool, Failure> {
        self.progress = None;
        let failures: Vec<String> = reports.iter().flat_map(Report::failures).collect();
        if !failures.is_empty() {
            self.print(&format!("\n{}\n", failures.join("\n")));
        }
        let rows = || reports.iter().flat_map(|report| &report.rows);
        let left_out = rows().filter(|row| matches!(row.outcome, Outcome::LeftOut(_))).count();
        let passed = rows().count() - left_out - failures.len();
        let mut line = format!("{passed} passed, {} failed", failures.len());
        if left_out > 0 {
            line += &format!(", {left_out} left out");
        }
        self.print(&format!("{line}, in {:.1} s", took.as_secs_f64()));
        self.printed?;
        Ok(failures.is_empty())
    }
}
