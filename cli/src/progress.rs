//! How far something has got, on standard error.

use std::io::{IsTerminal, Write};

/// Width of the bar in characters: with its text it has to fit a terminal of 80.
const WIDTH: usize = 24;

/// A bar that is drawn anew on a terminal and wiped away at the end; elsewhere a single line.
#[derive(Debug)]
pub struct Progress {
    what: String,
    total: usize,
    /// Where standard error is not a terminal no bar is drawn.
    terminal: bool,
    /// The percentage that the bar shows at present, if it is there.
    shown: Option<usize>,
}

impl Progress {
    /// Something begins, in `total` steps.
    pub fn new(what: impl Into<String>, total: usize) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let mut progress = Progress { what: what.into(), total: total.max(1), terminal, shown: None };
        if !terminal {
            write(&format!("tmcl: {}\n", progress.what));
        }
        progress.reach(0);
        progress
    }

    /// So many steps are done.
    pub fn reach(&mut self, done: usize) {
        let percent = done.min(self.total) * 100 / self.total;
        if self.terminal && self.shown != Some(percent) {
            self.shown = Some(percent);
            let full = WIDTH * percent / 100;
            write(&format!("\r{} [{}{}] {percent} %", self.what, "#".repeat(full), ".".repeat(WIDTH - full)));
        }
    }

    /// Makes room for a line of output.
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
    // Where standard error is closed there is nobody to tell.
    let _ = stderr.write_all(text.as_bytes()).and_then(|()| stderr.flush());
}
