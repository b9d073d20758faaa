//! The control protocol: one line of text in, one line of JSON out.

use std::net::TcpStream;

use hal_sim::control::{Control, Line, State};
use serde::Serialize;

use super::pacing::Pacer;
use super::stream::{Input, Stream};
use crate::device::Device;
use crate::fleet::Fleet;

/// Longest line; nothing of the protocol comes near it.
const LONGEST_LINE: usize = 4096;

/// A connection to the control port.
#[derive(Debug)]
pub struct Controller {
    /// Lines in, answers out.
    pub stream: Stream<TcpStream>,
    line: Vec<u8>,
}

impl Controller {
    /// A new connection.
    pub fn new(stream: Stream<TcpStream>) -> Self {
        Controller { stream, line: Vec::new() }
    }

    /// Takes what has arrived and answers each line with what `execute` makes of it.
    pub fn receive(&mut self, mut execute: impl FnMut(&str) -> String) {
        let mut buffer = [0; LONGEST_LINE];
        let mut answers = String::new();
        match self.stream.read(&mut buffer) {
            Input::Bytes(count) => {
                for byte in buffer.iter().take(count) {
                    if *byte == b'\n' {
                        answers += &self.answer(&mut execute);
                    } else if self.line.len() <= LONGEST_LINE {
                        self.line.push(*byte);
                    }
                }
            }
            // A last line may come without its end.
            Input::Ended if !self.line.is_empty() => answers += &self.answer(&mut execute),
            Input::Ended | Input::Nothing => {}
        }
        if !answers.is_empty() {
            // Who never reads its answers does not get them.
            self.stream.write(answers.as_bytes());
        }
    }

    fn answer(&mut self, execute: impl FnOnce(&str) -> String) -> String {
        let line = std::mem::take(&mut self.line);
        // One character more than that is kept of a longer one.
        if line.len() > LONGEST_LINE {
            return answer(Err(format!("a line has {LONGEST_LINE} characters at most"))) + "\n";
        }
        execute(&String::from_utf8_lossy(&line)) + "\n"
    }
}

/// An answer. Serialised it is one line.
#[derive(Serialize)]
struct Answer {
    ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(flatten)]
    report: Option<Report>,
}

/// The answer to `state`: the board's, and how time goes.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    state: State,
    /// How fast virtual time has been going lately, as a factor.
    speed_factor: f64,
    /// How fast it is wanted to go.
    speed_wanted: f64,
}

/// Carries out a line of the control protocol and gives the answer.
pub fn execute(line: &str, fleet: &mut Fleet<impl Device>, pacer: &Pacer) -> String {
    answer(carry_out(line, fleet, pacer))
}

fn answer(result: Result<Option<Report>, String>) -> String {
    let answer = match result {
        Ok(report) => Answer { ok: true, error: None, report },
        Err(error) => Answer { ok: false, error: Some(error), report: None },
    };
    serde_json::to_string(&answer)
        .unwrap_or_else(|_| r#"{"ok":false,"error":"the answer cannot be shown as JSON"}"#.into())
}

fn carry_out(line: &str, fleet: &mut Fleet<impl Device>, pacer: &Pacer) -> Result<Option<Report>, String> {
    let Line { module: number, control } = Line::parse(line)?;
    let count = fleet.modules().len();
    let index = number.wrapping_sub(1);
    let Some(module) = fleet.modules_mut().get_mut(index) else {
        let there_are = if count == 1 { "there is 1 module".into() } else { format!("there are {count} modules") };
        return Err(format!("no module {number}: {there_are}"));
    };
    let state = match control {
        Control::Power { on } => {
            fleet.set_power(index, on);
            None
        }
        Control::Usb { on } => {
            fleet.plug_usb(index, on);
            None
        }
        control => control.apply(&mut module.board_mut()),
    };
    let speed_factor = (pacer.achieved() * 1000.0).round() / 1000.0;
    Ok(state.map(|state| Report { state, speed_factor, speed_wanted: pacer.wanted() }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::world::config::WorldConfig;
    use std::time::Instant;

    #[test]
    fn one_line_of_json_for_each_command() {
        let mut fleet = Fleet::new(&WorldConfig::default(), &[None], 1);
        let pacer = Pacer::new(1.0, Instant::now(), 0);
        let mut ask = |line: &str| execute(line, &mut fleet, &pacer);
        assert_eq!(ask("supply 12.5"), r#"{"ok":true}"#);
        assert_eq!(ask("module 2 state"), r#"{"ok":false,"error":"no module 2: there is 1 module"}"#);
        assert_eq!(ask("power off"), r#"{"ok":true}"#);
        let state: serde_json::Value = serde_json::from_str(&ask("module 1 state")).unwrap();
        assert_eq!((&state["ok"], &state["power"]), (&true.into(), &false.into()));
        assert_eq!((&state["supply"], &state["speed_wanted"]), (&12.5.into(), &1.0.into()));
        assert!(state["time_us"].is_u64() && state["speed_factor"].is_f64());
        assert!(ask("jump").starts_with(r#"{"ok":false,"error":"unknown command 'jump'"#));
    }
}
