//! Parameters that are read again and again.

use std::io::Write;
use std::time::{Duration, Instant};

use tmcl_tools::shell::{State, Watched, text};
use tmcm::tmcl::{Command, Opcode};

use super::{Shell, redraw};
use crate::failure::Failure;
use crate::tell;
use crate::terminal::Keys;
use crate::terminal::system::Raw;

/// Time between two readings.
const INTERVAL: Duration = Duration::from_millis(200);

/// Shows parameters of an axis until a key is pressed or a signal comes; without a terminal once.
pub(super) fn watch(shell: &mut Shell, axis: u8, parameters: &[(String, u8)]) -> Result<Option<State>, Failure> {
    let mut last = read(shell, axis, parameters)?;
    if !shell.interactive {
        return Ok(Some(last));
    }
    let mut raw = Raw::begin()?;
    let ended = loop {
        redraw(&text(&last))?;
        let begun = Instant::now();
        let keys = raw.keys(INTERVAL, &shell.signal);
        shell.pass(begun.elapsed());
        if keys != Keys::Nothing {
            break Ok(());
        }
        match read(shell, axis, parameters) {
            Ok(values) => last = values,
            Err(failure) => break Err(failure),
        }
    };
    drop(raw);
    // The last values stay on the screen. The terminal may be gone.
    let _ = writeln!(tell::out());
    ended.map(|()| None)
}

fn read(shell: &mut Shell, axis: u8, parameters: &[(String, u8)]) -> Result<State, Failure> {
    let mut values = Vec::new();
    for (name, number) in parameters {
        let value = shell.module.value(Command::new(Opcode::Gap as u8, *number, axis, 0))?;
        values.push(Watched { name: name.clone(), value });
    }
    Ok(State::Watched { values })
}
