//! The user's terminal: lines that can be edited, and single keys. However the program ends, the terminal gets back the
//! settings that it had.
//!
//! * [`editor`] - lines with history and completion; plain lines where there is no terminal
//! * [`raw`] - keys as they are typed

pub mod editor;
pub mod raw;

use std::io::IsTerminal;

/// Width of the terminal on standard output in characters; 80 where there is none.
pub fn columns() -> usize {
    let size = rustix::termios::tcgetwinsize(std::io::stdout());
    size.map(|size| size.ws_col.into()).ok().filter(|columns| *columns > 0).unwrap_or(80)
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
