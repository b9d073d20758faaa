//! A progress bar on standard error.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use crate::terminal::columns_of_messages;

/// Width of the bar in characters; bar and text together must fit a terminal with 80 columns.
const WIDTH: usize = 24;
/// A bar of fewer characters tells nothing.
const SHORTEST: usize = 5;

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
            write(&format!("\r{}", drawn(&self.what, percent, columns_of_messages())));
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

/// A bar for the job that tells how far it has got, from its beginning until this is dropped.
#[derive(Debug, Default)]
pub struct Bar(Option<Progress>);

impl Bar {
    /// Shows how far the job has got.
    pub fn tell(&mut self, told: tmcl_tools::progress::Progress<'_>) {
        if told.done == 0 {
            self.0 = None;
        }
        self.0.get_or_insert_with(|| Progress::new(told.what, told.total)).reach(told.done);
    }

    /// Removes the bar, to make room for a line of output, until there is something new to show.
    pub fn pause(&mut self) {
        self.0.iter_mut().for_each(Progress::pause);
    }
}

/// A [`Bar`] as a function that shows how far the job has got.
pub fn bar() -> impl FnMut(tmcl_tools::progress::Progress<'_>) {
    let mut bar = Bar::default();
    move |told| bar.tell(told)
}

/// The same for a job that nobody has to be told of unless it takes longer than `patience`.
pub fn bar_after(patience: Duration) -> impl FnMut(tmcl_tools::progress::Progress<'_>) {
    let begun = Instant::now();
    let mut bar = bar();
    move |told| {
        if begun.elapsed() > patience {
            bar(told);
        }
    }
}

/// The bar on a terminal with so many columns, without the last of them: the next line would begin behind that. Where
/// it is narrow the bar is shorter, or left out, and at last the text is cut.
fn drawn(what: &str, percent: usize, columns: usize) -> String {
    let (text, end) = (what.chars().count(), format!(" {percent:3} %"));
    let room = columns.saturating_sub(1 + end.len());
    let width = WIDTH.min(room.saturating_sub(text + 3));
    if width < SHORTEST {
        return what.chars().take(room).collect::<String>() + &end;
    }
    let full = width * percent / 100;
    format!("{what} [{}{}]{end}", "#".repeat(full), ".".repeat(width - full))
}

fn write(text: &str) {
    let mut stderr = std::io::stderr();
    // A closed standard error must not end the program.
    let _ = stderr.write_all(text.as_bytes()).and_then(|()| stderr.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_fits_the_terminal() {
        let what = "reading 139 settings";
        assert_eq!(drawn(what, 50, 80), "reading 139 settings [############............]  50 %");
        assert_eq!(drawn(what, 50, 40), "reading 139 settings [#####.....]  50 %");
        assert_eq!(drawn(what, 100, 33), "reading 139 settings 100 %");
        assert_eq!(drawn(what, 7, 20), "reading 139 s   7 %");
        assert!((1..100).all(|columns| drawn(what, 100, columns).chars().count() < columns.max(7)));
    }
}
