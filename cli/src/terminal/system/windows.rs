//! The console of Windows.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, poll, read};
use crossterm::terminal::{disable_raw_mode, enable_raw_mode};
use tmcl_link::EndSignal;
use tmcl_tools::stop::Stop;

use crate::failure::Failure;
use crate::terminal::Keys;

/// How long a signal may go unnoticed while no key comes.
const GLANCE: Duration = Duration::from_millis(20);

/// The settings of the console. A program leaves the console as it is, because each program sets up its own.
#[derive(Clone, Debug)]
pub struct Settings(());

impl Settings {
    /// The settings that it has now.
    ///
    /// # Errors
    /// None.
    pub fn now() -> io::Result<Self> {
        Ok(Settings(()))
    }

    /// Gives the console its usual settings back.
    pub fn restore(&self) {
        let _ = disable_raw_mode();
    }
}

/// A console that gives each key at once. It gets its settings back when this is dropped.
#[derive(Debug)]
pub struct Raw(());

impl Raw {
    /// Has the console on standard input give single keys.
    ///
    /// # Errors
    /// Standard input is no console.
    pub fn begin() -> Result<Self, Failure> {
        let begun = if io::stdin().is_terminal() { enable_raw_mode() } else { Err(io::ErrorKind::Unsupported.into()) };
        match begun {
            Ok(()) => Ok(Raw(())),
            Err(_) => Err(Failure::Failed("keys can be read from a console only; standard input is none".into())),
        }
    }

    /// Waits for keys, at most for `time`.
    pub fn keys(&mut self, time: Duration, signal: &EndSignal) -> Keys {
        let until = Instant::now() + time;
        loop {
            if signal.happened() {
                return Keys::Signal;
            }
            let left = until.saturating_duration_since(Instant::now());
            match poll(left.min(GLANCE)) {
                Ok(false) if left.is_zero() => return Keys::Nothing,
                Ok(false) => continue,
                Ok(true) => {}
                Err(_) => return Keys::Closed,
            }
            match read() {
                Ok(Event::Key(key)) if key.kind != KeyEventKind::Release => match typed(key) {
                    Some(bytes) => return Keys::Typed(bytes),
                    None => return Keys::Signal,
                },
                Ok(_) => {}
                Err(_) => return Keys::Closed,
            }
        }
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        // The console may be gone.
        let _ = disable_raw_mode();
        let _ = io::stdout().flush();
    }
}

/// The bytes that a terminal sends for a key; `None` for Ctrl-C, which is a signal elsewhere.
fn typed(key: KeyEvent) -> Option<Vec<u8>> {
    let text = match key.code {
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => return None,
        KeyCode::Char(letter) => letter.to_string(),
        KeyCode::Enter => "\r".into(),
        KeyCode::Right => "\x1b[C".into(),
        KeyCode::Left => "\x1b[D".into(),
        // Any other key is another one.
        _ => "\x1b[A".into(),
    };
    Some(text.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_what_terminals_send() {
        let key = |code, modifiers| typed(KeyEvent::new(code, modifiers));
        assert_eq!(key(KeyCode::Right, KeyModifiers::NONE), Some(b"\x1b[C".to_vec()));
        assert_eq!(key(KeyCode::Char(' '), KeyModifiers::NONE), Some(b" ".to_vec()));
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::NONE), Some(b"c".to_vec()));
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::CONTROL), None);
    }
}
