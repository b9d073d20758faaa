//! A progress bar on standard error.

use std::io::{IsTerminal, Write};

/// Width of the bar in characters; bar and text together must fit a terminal with 80 columns.
const WIDTH: usize = 24;

/// A bar that is redrawn on a terminal and removed at the end. If standard error is no terminal, a single line is
/// printed.
#[derive(Debug)]
pub struct Progress {
    what: String,
    total: usize,
    /// True if standard error is a terminal.
    terminal: bool,
    /// The percentage that the bar shows; `None` while no bar is drawn.
    shown: Option<usize>,
}

impl Progress {
    /// Begins the bar of an activity `what` that takes `total` steps.
    pub fn new(what: impl Into<String>, total: usize) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let mut progress = Progress { what: what.into(), total: total.max(1), terminal, shown: None };
        if !terminal {
            write(&format!("tmcl: {}\n", progress.what));
        }
        progress.reach(0);
        progress
    }

    /// Shows that `done` steps are done.
    pub fn reach(&mut self, done: usize) {
        let percent = done.min(self.total) * 100 / self.total;
        if self.terminal && self.shown != Some(percent) {
            self.shown = Some(percent);
            let full = WIDTH * percent / 100;
            write(&format!("\r{} [{}{}] {percent} %", self.what, "#".repeat(full), ".".repeat(WIDTH - full)));
        }
    }

    /// Removes the bar, to make room for a line of output.
    pub fn pause(&mut self) {
        if self.shown.take().is_some() {
            write("\r\x1b[K");
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.pause();
    }
}

fn write(text: &str) {
    let mut stderr = std::io::stderr();
    // A closed standard error must not end the program.
    let _ = stderr.write_all(text.as_bytes()).and_then(|()| stderr.flush());
}
