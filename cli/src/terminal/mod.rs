//! The user's terminal: lines that can be edited, and single keys. However the program ends, the terminal gets back the
//! settings that it had.
//!
//! * [`editor`] - lines with history and completion; plain lines where there is no terminal
//! * [`system`] - keys as they are typed, without echo and without waiting for the end of a line

pub mod editor;
pub mod system;

use std::io::IsTerminal;

use terminal_size::{Height, Width};

/// Width of the terminal on standard output in characters; 80 where there is none.
pub fn columns() -> usize {
    width(terminal_size::terminal_size_of(std::io::stdout()))
}

/// The same of the terminal on standard error.
pub fn columns_of_messages() -> usize {
    width(terminal_size::terminal_size_of(std::io::stderr()))
}

fn width(size: Option<(Width, Height)>) -> usize {
    size.map(|(Width(columns), _)| columns.into()).filter(|columns| *columns > 0).unwrap_or(80)
}

/// The outcome of waiting for keys.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Keys {
    /// The bytes that were typed since the last time, as terminals send it; a key may be several bytes, and a held key
    /// comes again and again.
    Typed(Vec<u8>),
    /// Nothing was typed in time.
    Nothing,
    /// A signal has come; Ctrl-C is one.
    Signal,
    /// The terminal is gone.
    Closed,
}

/// True if somebody sits at a terminal: standard input and standard output are one.
pub fn is_interactive() -> bool {
    std::io::stdin().is_terminal() && std::io::stdout().is_terminal()
}

/// A line that fits a terminal with so many columns.
pub fn fitting(line: &str, columns: usize) -> String {
    const CUT: &str = "...";
    let most = columns.saturating_sub(1);
    if line.chars().count() <= most {
        return line.into();
    }
    let kept: String = line.chars().take(most.saturating_sub(CUT.len())).collect();
    kept + CUT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_where_the_terminal_ends() {
        assert_eq!(fitting("position 5", 11), "position 5");
        assert_eq!(fitting("position 5", 10), "positi...");
    }
}
