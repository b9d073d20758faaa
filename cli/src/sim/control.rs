//! The control protocol: one line of text in, one line of JSON out.

use std::collections::VecDeque;
use std::net::TcpStream;
use std::os::fd::BorrowedFd;
use std::time::Instant;

use hal_sim::control::{Control, Line, State};
use rustix::event::PollFlags;
use serde::Serialize;

use super::pacing::Pacer;
use super::stream::{Input, Stream};
use super::tcp::{Guest, MOST_CONNECTIONS};
use crate::suggest::{module_command, world_command};
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::Fleet;

/// Longest line; nothing of the protocol comes near it.
const LONGEST_LINE: usize = 4096;
/// Lines of a client that are carried out in a turn of the simulator: those of all clients together hold up nobody.
const LINES: usize = 4;
/// What a request of HTTP begins with.
const METHODS: [&str; 9] = ["GET", "HEAD", "POST", "PUT", "DELETE", "CONNECT", "OPTIONS", "TRACE", "PATCH"];

/// A connection to the control port.
#[derive(Debug)]
pub struct Controller {
    /// Lines in, answers out.
    stream: Stream<TcpStream>,
    /// Bytes that have come and that nobody has looked at.
    unread: VecDeque<u8>,
    line: Vec<u8>,
    /// A command has come.
    trusted: bool,
    /// When the last line came, or the connection.
    heard: Instant,
}

impl Controller {
    /// A new connection.
    pub fn new(stream: Stream<TcpStream>) -> Self {
        Controller { stream, unread: VecDeque::new(), line: Vec::new(), trusted: false, heard: Instant::now() }
    }

    /// Takes what has arrived and answers some lines, each with what `execute` makes of it. While answers wait for a
    /// client that does not read them, no more of its lines are taken.
    pub fn receive(&mut self, mut execute: impl FnMut(&str) -> String) {
        if self.wants_more() {
            let mut buffer = [0; LONGEST_LINE];
            match self.stream.read(&mut buffer) {
                Input::Bytes(count) => self.unread.extend(buffer.iter().take(count)),
                // A last line may come without its end.
                Input::Ended if !self.line.is_empty() => self.unread.push_back(b'\n'),
                Input::Ended | Input::Nothing => {}
            }
        }
        let mut lines = 0;
        while lines < LINES
            && self.has_unread()
            && let Some(byte) = self.unread.pop_front()
        {
            if byte == b'\n' {
                self.take_line(&mut execute);
                lines += 1;
            } else if self.line.len() <= LONGEST_LINE {
                self.line.push(byte);
            }
        }
    }

    fn take_line(&mut self, execute: impl FnOnce(&str) -> String) {
        self.heard = Instant::now();
        let line = std::mem::take(&mut self.line);
        let text = String::from_utf8_lossy(&line);
        // One character more than that is kept of a longer one.
        let too_long = line.len() > LONGEST_LINE;
        self.trusted |= !too_long && Line::parse(&text).is_ok();
        if !self.trusted && (too_long || is_http(&text)) {
            // Any web page can make a browser send lines, behind this one.
            self.unread.clear();
            return self.stream.give_up();
        }
        let answer = if too_long {
            answer(Err(format!("a line has {LONGEST_LINE} characters at most")))
        } else {
            execute(&text)
        };
        self.stream.write((answer + "\n").as_bytes());
    }

    /// Writes what waits. True once there is nothing more to be done.
    pub fn finish(&mut self) -> bool {
        self.stream.flush();
        self.stream.ended() && self.stream.drained() && self.unread.is_empty()
    }

    /// What to wait for, as [`Stream::interest`] has it.
    pub fn interest(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        self.stream.interest(!self.wants_more())
    }

    /// Something that has come waits for the next turn, and for nothing else.
    pub fn has_unread(&self) -> bool {
        !self.unread.is_empty() && !self.stream.is_full()
    }

    fn wants_more(&self) -> bool {
        self.unread.is_empty() && !self.stream.is_full()
    }
}

impl Guest for Controller {
    fn idle_since(&self) -> Option<Instant> {
        (self.unread.is_empty() && self.stream.drained()).then_some(self.heard)
    }

    fn dismiss(mut self) {
        let why = format!("closed: there are {MOST_CONNECTIONS} connections, and no more at one time");
        self.stream.write((answer(Err(why)) + "\n").as_bytes());
    }
}

/// Whether a request of HTTP may begin with this line: a method that is known, or any with a path or address behind it.
fn is_http(line: &str) -> bool {
    let lower = line.to_ascii_lowercase();
    let behind = lower.split_whitespace().nth(1).unwrap_or_default();
    lower.contains(" http/")
        || ["/", "http:", "https:"].iter().any(|beginning| behind.starts_with(beginning))
        || line.split_whitespace().next().is_some_and(|word| METHODS.contains(&word))
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
pub fn execute(line: &str, fleet: &mut Fleet<impl VirtualModule>, pacer: &Pacer) -> String {
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

fn carry_out(line: &str, fleet: &mut Fleet<impl VirtualModule>, pacer: &Pacer) -> Result<Option<Report>, String> {
    let Line { module: number, control } = Line::parse(line).map_err(|error| misplaced(line).unwrap_or(error))?;
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
        Control::Can { state } => {
            fleet.set_can(index, state);
            None
        }
        Control::Usb { on } => {
            fleet.plug_usb(index, on);
            None
        }
        control => control.apply(&mut module.board_mut())?,
    };
    let speed_factor = (pacer.achieved() * 1000.0).round() / 1000.0;
    Ok(state.map(|state| Report { state, speed_factor, speed_wanted: pacer.wanted() }))
}

/// Message about a line that would be a command in small letters, or for the module; `None` for any other line.
fn misplaced(line: &str) -> Option<String> {
    if let Some(meant) = world_command(line) {
        return Some(format!("the commands here are written in small letters; did you mean '{meant}'?"));
    }
    let command = module_command(line)?;
    Some(format!(
        "'{command}' is a command for the module; send it over one of its links: tmcl send LINK \"{command}\""
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::board::{Board, BoardKind, TMCM_1140};
    use hal_sim::world::config::WorldConfig;
    use std::time::Instant;

    #[test]
    fn requests_of_http_are_told_from_commands() {
        let http = ["GET / HTTP/1.1", "POST /x", "PRI * HTTP/2.0", "q * Http/1.1", "OPTIONS", "QUERY /", "q HTTP://x"];
        assert!(http.iter().all(|line| is_http(line)));
        assert!(
            !["", "state", "get", "press left", "POSTER", "module 1 GET", "input 1/2"].iter().any(|line| is_http(line))
        );
    }

    #[test]
    fn a_state_has_the_fields_of_axis_0_and_a_list_of_all_axes() {
        static KIND: BoardKind = BoardKind { controllers: &[3, 3], pull_ups: 2, ..TMCM_1140 };
        let mut board = Board::of_kind(&KIND, &WorldConfig::default(), 0);
        for line in ["press left 4", "load 0.5 5", "slip 8 0"] {
            Line::parse(line).unwrap().control.apply(&mut board).unwrap();
        }
        let state = serde_json::to_value(State::of(&board)).unwrap();
        let names = "abn analog analogs axes bridges_on can current encoder field inputs leds load lost_steps outputs position \
                     power pull_up_groups pull_ups rotor stall_guard supply switches temperature time_us velocity";
        let mut fields: Vec<&str> = state.as_object().unwrap().keys().map(String::as_str).collect();
        fields.sort_unstable();
        assert_eq!(fields, names.split_whitespace().collect::<Vec<_>>());
        let axes = state["axes"].as_array().unwrap();
        for (name, value) in axes[0].as_object().unwrap() {
            assert_eq!(&state[name], value, "{name}");
        }
        assert_eq!((axes.len(), &state["rotor"]), (6, &2048.into()));
        assert!((0..6).all(|axis| axes[axis]["switches"]["left"] == (axis == 4)));
        assert!((0..6).all(|axis| axes[axis]["load"] == if axis == 5 { 0.5 } else { 0.0 }));
    }

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
        assert!(ask("Power OFF").contains("did you mean 'power off'?"));
        assert!(ask("gap 1, 0").contains("'GAP 1, 0' is a command for the module"));
        assert!(ask("jump").starts_with(r#"{"ok":false,"error":"unknown command 'jump'"#));
    }
}
