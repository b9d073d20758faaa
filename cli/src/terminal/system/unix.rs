//! Terminals of Unix.

use std::io::{self, Stdin, Write};
use std::time::{Duration, Instant};

use rustix::io::Errno;
use rustix::termios::{LocalModes, OptionalActions, SpecialCodeIndex, Termios};
use tmcl_link::EndSignal;
use tmcl_link::poll::{Ready, either};

use crate::failure::Failure;
use crate::terminal::Keys;

/// Ends the mode in which a terminal marks what is pasted, which the line editor begins, and begins a new line.
const PASTE_OFF: &[u8] = b"\x1b[?2004l\n";

/// The settings of the terminal on standard input.
#[derive(Clone, Debug)]
pub struct Settings(Termios);

impl Settings {
    /// The settings that it has now.
    ///
    /// # Errors
    /// Standard input is no terminal.
    pub fn now() -> io::Result<Self> {
        Ok(Settings(rustix::termios::tcgetattr(io::stdin())?))
    }

    /// Gives the terminal these settings back, and has it end what a line editor may have begun. It may be gone.
    pub fn restore(&self) {
        let _ = rustix::termios::tcsetattr(io::stdin(), OptionalActions::Now, &self.0);
        // Whoever waits for the line may hold the lock of standard output, so this goes past it.
        let _ = rustix::io::write(io::stdout(), PASTE_OFF);
    }
}

/// A terminal that gives each key at once. It gets its settings back when this is dropped.
#[derive(Debug)]
pub struct Raw {
    stdin: Stdin,
    settings: Termios,
}

impl Raw {
    /// Has the terminal on standard input give single keys.
    ///
    /// # Errors
    /// Standard input is no terminal.
    pub fn begin() -> Result<Self, Failure> {
        let stdin = std::io::stdin();
        let begun = rustix::termios::tcgetattr(&stdin).and_then(|settings| {
            let mut raw = settings.clone();
            raw.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
            raw.special_codes[SpecialCodeIndex::VMIN] = 1;
            raw.special_codes[SpecialCodeIndex::VTIME] = 0;
            rustix::termios::tcsetattr(&stdin, OptionalActions::Now, &raw)?;
            Ok(settings)
        });
        match begun {
            Ok(settings) => Ok(Raw { stdin, settings }),
            Err(_) => Err(Failure::Failed("keys can be read from a terminal only; standard input is none".into())),
        }
    }

    /// Waits for keys, at most for `time`.
    pub fn keys(&mut self, time: Duration, signal: &EndSignal) -> Keys {
        let until = Instant::now() + time;
        loop {
            match either(signal, &self.stdin, Some(until)) {
                Ok(Ready::Nothing) => return Keys::Nothing,
                Ok(Ready::First) => return Keys::Signal,
                Ok(Ready::Second) => {}
                Err(_) => return Keys::Closed,
            }
            let mut bytes = [0; 256];
            match rustix::io::read(&self.stdin, &mut bytes) {
                Ok(count @ 1..) => return Keys::Typed(bytes.iter().copied().take(count).collect()),
                Err(Errno::INTR | Errno::AGAIN) => {}
                Ok(_) | Err(_) => return Keys::Closed,
            }
        }
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        // What was typed and not read is meant for nobody. The terminal may be gone.
        let _ = rustix::termios::tcsetattr(&self.stdin, OptionalActions::Flush, &self.settings);
        let _ = std::io::stdout().flush();
    }
}
