//! Messages to people and programs on standard output and standard error.
//!
//! Much of it comes from elsewhere: lines of files, names, what a module or a simulator has answered. Characters in it
//! that control a terminal could clear its screen, change its title or show text in another order than it has, so they
//! are shown and never sent.

use std::fmt;
use std::io::{self, IsTerminal, Stderr, StdoutLock, Write};

use anstream::stream::RawStream;
use anstream::{AutoStream, ColorChoice};
use tmcl_tools::shown::shown;

/// When words have colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Colours {
    /// On a terminal that has them, unless the environment variable NO_COLOR is set
    #[default]
    Auto,
    /// Also in files and for other programs
    Always,
    /// Nowhere
    Never,
}

impl Colours {
    /// Decides so for the rest of the program.
    pub fn choose(self) {
        // A console of Windows has to be told that it gets colours; one that cannot show them gets none.
        let has_none = anstyle_query::windows::enable_ansi_colors() == Some(false);
        let choice = match self {
            Colours::Auto if has_none => ColorChoice::Never,
            Colours::Auto => ColorChoice::Auto,
            Colours::Always => ColorChoice::AlwaysAnsi,
            Colours::Never => ColorChoice::Never,
        };
        choice.write_global();
    }
}

/// The role of a word, where that shows by a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// The head of an error.
    Error,
    /// The head of a warning.
    Warning,
    /// A value that is another one now.
    Changed,
    /// A value as it was, or is elsewhere.
    Former,
}

impl Tone {
    /// The sequence that gives a terminal the colour: bold red, bold yellow, green, red.
    const fn begin(self) -> &'static str {
        match self {
            Tone::Error => "\x1b[1;31m",
            Tone::Warning => "\x1b[1;33m",
            Tone::Changed => "\x1b[32m",
            Tone::Former => "\x1b[31m",
        }
    }
}

/// The sequence that ends a colour.
const END: &str = "\x1b[0m";

/// Tells an error on standard error, behind the name of the program.
///
/// # Errors
/// It cannot be written.
pub fn error(text: impl fmt::Display) -> io::Result<()> {
    err().toned("", Tone::Error, "tmcl:", &format!(" {text}\n"))
}

/// Tells a warning on standard error, behind the name of the program.
///
/// # Errors
/// It cannot be written.
pub fn warning(text: impl fmt::Display) -> io::Result<()> {
    err().toned("", Tone::Warning, "tmcl: warning:", &format!(" {text}\n"))
}

/// Tells a line on standard error, in the place of a progress bar if one is there.
///
/// # Errors
/// It cannot be written.
pub fn line(text: &str) -> io::Result<()> {
    let mut err = err();
    if err.is_terminal() {
        err.redraw("")?;
    }
    writeln!(err, "{text}")
}

/// Standard output or standard error, where all that is written is [`shown`].
#[derive(Debug)]
pub struct Shown<W>(W);

/// Standard output.
pub fn out() -> Shown<StdoutLock<'static>> {
    Shown(io::stdout().lock())
}

/// Standard error.
pub fn err() -> Shown<Stderr> {
    Shown(io::stderr())
}

impl<W: Write + IsTerminal> Shown<W> {
    /// True if somebody sees it at once.
    pub fn is_terminal(&self) -> bool {
        self.0.is_terminal()
    }

    /// Puts a line of text in the place of the one at which the cursor is.
    ///
    /// # Errors
    /// The text cannot be written.
    pub fn redraw(&mut self, line: &str) -> io::Result<()> {
        write!(self.0, "\r{}\x1b[K", shown(line))?;
        self.0.flush()
    }
}

impl<W: Write + RawStream> Shown<W> {
    /// Writes a text in the colour of its tone, if colours are wanted, and what stands before and behind it. It is
    /// written all at once, as everything is.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn toned(&mut self, before: &str, tone: Tone, text: &str, behind: &str) -> io::Result<()> {
        let (begin, end) = match AutoStream::choice(&self.0) {
            ColorChoice::Never => ("", ""),
            _ => (tone.begin(), END),
        };
        let whole = format!("{}{begin}{}{end}{}", shown(before), shown(text), shown(behind));
        self.0.write_all(whole.as_bytes())
    }
}

impl<W: Write> Write for Shown<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write_all(shown(&String::from_utf8_lossy(bytes)).as_bytes())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }

    /// Writes all at once, so that lines of several threads do not mix.
    fn write_fmt(&mut self, text: fmt::Arguments<'_>) -> io::Result<()> {
        self.write_all(text.to_string().as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_controls_a_terminal_is_shown() {
        for (text, expected) in [
            ("motor \u{1b}[2J\u{7}", "motor \\u001b[2J\\u0007"),
            ("\u{9b}31m\u{7f}\r", "\\u009b31m\\u007f\\u000d"),
            ("a\u{202e}b\u{2069}\u{200f}", "a\\u202eb\\u2069\\u200f"),
            ("plain ÄÖ µ €\t\n", "plain ÄÖ µ €\t\n"),
            ("", ""),
        ] {
            assert_eq!(shown(text), expected);
            let mut out = Shown(Vec::new());
            write!(out, "{text}").unwrap();
            assert_eq!(String::from_utf8(out.0).unwrap(), expected);
        }
    }

    #[test]
    fn a_line_of_json_says_the_same() {
        let value = serde_json::json!({ "name": "\u{1b}]0;x\u{7}\u{9d}\u{7f}\u{202e}" });
        let line = value.to_string();
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown(&line)).unwrap(), value);
        assert!(!shown(&line).contains(|c: char| c.is_control() || c == '\u{202e}'));
    }
}
