//! The debugger's input: lines from standard input, with a prompt on a terminal.

use std::fs::File;
use std::io::{BufRead, BufReader, IsTerminal, Write};
use std::os::fd::AsFd;

use rustix::event::{PollFd, PollFlags};
use rustix::io::Errno;

use crate::failure::Failure;
use crate::signal::EndSignal;

/// The outcome of waiting for a line.
pub(super) enum Line {
    /// A line, without its line end.
    Text(String),
    /// A signal has come before a line.
    Interrupted,
    /// The input has ended.
    End,
}

/// Standard input with a buffer of its own, so that lines waiting in the buffer are seen before the descriptor is
/// polled.
pub(super) struct Input {
    lines: BufReader<File>,
    terminal: bool,
}

impl Input {
    pub(super) fn open() -> Result<Self, Failure> {
        let stdin = std::io::stdin();
        let lines = stdin.as_fd().try_clone_to_owned().map_err(failed)?;
        Ok(Input { lines: BufReader::new(File::from(lines)), terminal: stdin.is_terminal() })
    }

    /// Waits for the next line.
    pub(super) fn line(&mut self, out: &mut impl Write, signal: &mut EndSignal) -> Result<Line, Failure> {
        if self.terminal {
            write!(out, "(tmcl) ")?;
            out.flush()?;
        }
        if self.lines.buffer().is_empty() && interrupted(self.lines.get_ref(), signal).map_err(failed)? {
            signal.forget();
            if self.terminal {
                writeln!(out)?;
                return Ok(Line::Interrupted);
            }
            return Ok(Line::End);
        }
        let mut line = String::new();
        match self.lines.read_line(&mut line).map_err(failed)? {
            0 => {
                if self.terminal {
                    writeln!(out)?;
                }
                Ok(Line::End)
            }
            _ => Ok(Line::Text(line)),
        }
    }
}

/// Waits until there is something to read; true if a signal came first.
fn interrupted(input: &File, signal: &EndSignal) -> std::io::Result<bool> {
    let mut polled = [PollFd::new(signal, PollFlags::IN), PollFd::new(input, PollFlags::IN)];
    loop {
        match rustix::event::poll(&mut polled, None) {
            Ok(_) => return Ok(!polled[0].revents().is_empty()),
            Err(Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
    }
}

fn failed(error: std::io::Error) -> Failure {
    Failure::Failed(format!("cannot read standard input: {error}"))
}
