//! Lines from standard input, with a prompt where somebody sees it.

use std::fs::File;
use std::io::{BufRead, BufReader, IsTerminal, Write};
use std::os::fd::AsFd;

use rustix::event::{PollFd, PollFlags};
use rustix::io::Errno;

use crate::failure::Failure;
use crate::signal::EndSignal;

/// What came.
pub(super) enum Line {
    /// A line, without its end.
    Text(String),
    /// A signal in place of a line.
    Interrupted,
    /// Nothing will come any more.
    End,
}

/// Standard input. It has a buffer of its own, so that what waits in it is known.
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
