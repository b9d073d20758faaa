//! Questions to the user, and lines from standard input that are waited for while the motor turns.

use std::io::{ErrorKind, IsTerminal, Read};
use std::time::{Duration, Instant};

use tmcl_link::EndSignal;
use tmcl_link::poll::readable;
use tmcl_link::system::{Input, standard_input};
use tmcl_link::wording::words;
use tmcl_tools::failure::Failure;
use tmcl_tools::stop::Stop;

use crate::tell;

/// Time between two looks for a signal.
const LOOK: Duration = Duration::from_millis(50);

/// Asks whether to go on. Without a terminal there is nobody who could be asked.
pub(super) fn consent(question: &str, signal: &EndSignal) -> Result<(), Failure> {
    let mut lines = Lines::open()?;
    lines.say(&format!("{question} [y/N]"));
    loop {
        if let Some(answer) = lines.next()? {
            return match answer.trim().to_lowercase().as_str() {
                "y" | "yes" => Ok(()),
                _ => Err(Failure::Failed("nothing was moved and nothing changed".into())),
            };
        }
        if signal.within(LOOK) {
            return Err(signal.interrupted(""));
        }
    }
}

/// True if somebody can be asked.
pub(super) fn can_ask() -> bool {
    std::io::stdin().is_terminal() && std::io::stderr().is_terminal()
}

/// Lines of standard input.
#[derive(Debug)]
pub(super) struct Lines {
    input: Input,
    begun: Vec<u8>,
}

impl Lines {
    /// Lines from now on.
    ///
    /// # Errors
    /// Standard input cannot be read.
    pub(super) fn open() -> Result<Self, Failure> {
        Ok(Lines { input: standard_input().map_err(|error| nobody(words(error)))?, begun: Vec::new() })
    }

    /// Tells the user something. It goes to standard error, which is not part of the result.
    pub(super) fn say(&self, text: &str) {
        // A closed standard error must not end a measurement.
        let _ = tell::line(text);
    }

    /// Whether the user has confirmed what was asked for: with Enter, or yes.
    ///
    /// # Errors
    /// Another word, which nobody types who has done it.
    pub(super) fn confirmed(&mut self) -> Result<bool, Failure> {
        let Some(line) = self.next()? else { return Ok(false) };
        match line.trim().to_lowercase().as_str() {
            "" | "y" | "yes" => Ok(true),
            other => Err(Failure::Failed(format!("ended by '{other}'"))),
        }
    }

    /// The next line, if it is there already.
    pub(super) fn next(&mut self) -> Result<Option<String>, Failure> {
        while readable(&self.input, Instant::now()).map_err(|error| nobody(words(error)))? {
            let mut byte = [0];
            match self.input.read(&mut byte) {
                Ok(0) => return Err(nobody("standard input has ended".into())),
                Ok(_) if byte == [b'\n'] => {
                    return Ok(Some(String::from_utf8_lossy(&std::mem::take(&mut self.begun)).into_owned()));
                }
                Ok(_) => self.begun.extend(byte),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(nobody(words(error))),
            }
        }
        Ok(None)
    }
}

fn nobody(why: String) -> Failure {
    Failure::Failed(format!("nobody answers: {why}"))
}
