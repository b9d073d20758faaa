//! A motor that is moved by holding a key.

use std::time::{Duration, Instant};

use tmcl_link::EndSignal;
use tmcl_tools::conversation::Error;
use tmcl_tools::shell::{Jog, JogEnd, State, Step, text};

use super::keys::{Reader, sum};
use super::{Shell, redraw};
use crate::failure::Failure;
use crate::terminal::Keys;
use crate::terminal::system::Raw;

/// How often it is shown where the axis is, while no key comes.
const LOOK: Duration = Duration::from_millis(100);
/// How long the rest of a key may take that has come in part.
const REST_OF_KEY: Duration = Duration::from_millis(30);

/// Lets the user move an axis by keys, until one of them, a signal or an error ends that. The motor stands then, or
/// comes to rest by itself if the module is out of reach.
pub(super) fn jog(shell: &mut Shell, axis: u8, speed: Option<i32>) -> Result<State, Failure> {
    let mut jog = match Jog::prepare(&mut shell.module, axis, speed)? {
        Ok(jog) => jog,
        Err(wrong) => return Ok(wrong),
    };
    super::tell(&jog.ready())?;
    let mut raw = Raw::begin()?;
    let ended = jog.begin().and_then(|()| follow(&mut jog, &mut raw, &shell.signal));
    let (state, owed) = jog.end(ended);
    drop(raw);
    shell.owed = owed;
    // The terminal may be gone.
    let _ = redraw("");
    Ok(state)
}

/// Does what keys ask for.
fn follow(jog: &mut Jog<'_>, raw: &mut Raw, signal: &EndSignal) -> Result<JogEnd, Error> {
    let mut reader = Reader::default();
    loop {
        let begun = Instant::now();
        let wait = if reader.has_begun() { REST_OF_KEY } else { LOOK };
        let keys = raw.keys(wait, signal);
        jog.pass(begun.elapsed(), signal);
        match keys {
            Keys::Typed(bytes) => match sum(&reader.take(&bytes)).map(|key| jog.press(key)).transpose()? {
                Some(Step::Moving(state)) => show(&state),
                Some(Step::Over(end)) => return Ok(end),
                Some(Step::Done) | None => {}
            },
            // A key that has only begun is another one: Escape.
            Keys::Nothing if reader.has_begun() => return Ok(JogEnd::Key),
            Keys::Nothing => show(&jog.look()?),
            Keys::Signal | Keys::Closed => return Ok(JogEnd::Signal),
        }
    }
}

fn show(state: &State) {
    // Without a terminal nobody looks; that it is gone is noticed where keys are read.
    let _ = redraw(&text(state));
}
