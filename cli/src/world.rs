//! `tmcl world`: commands to the control port of `tmcl sim`, as a script or a hand gives them.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use clap::Args;
use serde_json::{Map, Value};
use tmcl_link::EndSignal;
use tmcl_link::poll::{Ready, either};
use tmcl_link::wording::words;
use tmcl_server::options;
use tmcm_sim::protocol::TIME;
use tmcm_sim::suggest::suggestion;

use crate::failure::{Ended, Failure};
use crate::tell;

/// Fields of which each line from a control port has one: an answer, values that are watched, and the end of a watch.
const MARKS: [&str; 3] = [DONE, TIME, ENDED];
/// Longest answer in bytes; a state of six axes has some three thousand.
const LONGEST_ANSWER: u64 = 1 << 20;
/// The field that says whether a command was carried out.
const DONE: &str = "ok";
/// All fields of the answer to a command for time.
const FOR_TIME: [&str; 3] = [DONE, "met", TIME];
/// The field of the last line of a watch.
const ENDED: &str = "ended";
/// The field of a state that has the axes, one behind the other. What is of axis 0 stands beside it as well.
const AXES: &str = "axes";
/// The command without any.
const STATE: &str = "state";
/// The command that lines without a command follow.
const WATCH: &str = "watch";
/// Commands that take virtual time, so that nobody knows how long an answer takes.
const LASTING: [&str; 3] = ["step", "run-until", "restart"];
/// How long the answer to another command may take.
const USUAL: Duration = Duration::from_secs(5);

/// Change the world around a virtual module, its time too, and look at it: switches, loads, faults, supply
///
/// Sends commands to the control port of `tmcl sim --control ADDR:PORT`, one after the other. Prints the answer to
/// each, a line of JSON, or with --text lines for people. docs/control.md has all commands, faults, and fields of a
/// state; the module itself is asked by `tmcl send`. Lines of a `watch` are printed as they come; behind `watch` as the
/// last command until Ctrl-C.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The control port, as `tmcl sim` prints it
    #[arg(value_name = "ADDR:PORT", value_parser = address)]
    pub address: String,

    /// The commands, each in quotes; without any it is `state`
    #[arg(value_name = "COMMAND", default_value = STATE, value_parser = command)]
    pub commands: Vec<String>,

    /// Print this field of each state and nothing else, such as position, switches.left or axes.2.velocity
    ///
    /// A text is printed without its quotes. Commands that are carried out without telling anything print nothing.
    #[arg(long, value_name = "FIELD")]
    pub value: Option<String>,

    /// Print each answer for people: a line for each field, by its name for --value, and a column for each axis
    #[arg(long, conflicts_with = "value")]
    pub text: bool,

    /// How long to wait for each answer, in milliseconds; without it 5000, but for steps as long as they take
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=600_000))]
    pub timeout: Option<u64>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl world 127.0.0.1:4141                             the state of the module
  tmcl world 127.0.0.1:4141 \"press left\"                a switch by hand
  tmcl world 127.0.0.1:4141 \"load 0.5 2\" state          a load on axis 2, and what comes of it
  tmcl world 127.0.0.1:4141 --text                      the same, to be read
  tmcl world 127.0.0.1:4141 state --value axes.0.rotor  a number for a script
  tmcl world 127.0.0.1:4141 \"watch 100 ms rotor\"       where the rotor is, ten times a second
  tmcl world 127.0.0.1:4141 pause \"step 20 ms\" state   time stands still, and goes on by this much
The exit code is 1 if a command was refused.";

/// Reads the address of the port.
pub(crate) fn address(text: &str) -> Result<String, String> {
    let address = options::address(text.strip_prefix("tcp:").unwrap_or(text))?;
    match address.ends_with(":0") {
        true => Err("port 0 is none; tmcl sim prints the one that it has taken".into()),
        false => Ok(address),
    }
}

/// Reads a command, which is one line. Whether it is one that the simulator knows, that will say.
fn command(text: &str) -> Result<String, String> {
    match text.contains('\n') {
        true => Err("a command is one line; give each in quotes of its own".into()),
        false => Ok(text.into()),
    }
}

/// Sends the commands one after the other, and prints the answers.
pub fn run(options: &Options) -> Result<(), Failure> {
    let given = options.timeout.map(Duration::from_millis);
    let mut port = Port::connect(&options.address, given.unwrap_or(USUAL))?;
    let mut all_done = true;
    for command in &options.commands {
        let timeout = if is_one_of(&LASTING, command) { given } else { Some(given.unwrap_or(USUAL)) };
        port.send(command)?;
        loop {
            let (line, answer) = port.line(command, timeout)?;
            let answered = answer.contains_key(DONE);
            let done = !answered || answer.get(DONE) == Some(&Value::Bool(true));
            all_done &= done;
            options.print(command, &line, answer, done)?;
            if answered {
                break;
            }
        }
    }
    match options.commands.last() {
        Some(command) if all_done && is_one_of(&[WATCH], command) => follow(&mut port, options, command),
        _ if all_done => Ok(()),
        _ => Err(Failure::Reported),
    }
}

/// Prints the lines of a watch until it ends, or a signal comes.
fn follow(port: &mut Port, options: &Options, command: &str) -> Result<(), Failure> {
    let end = EndSignal::watch()?;
    let mut goes_on = true;
    while goes_on {
        if !port.has_line() && either(&end, port.lines.get_ref(), None)? == Ready::First {
            return Err(end.failure(""));
        }
        let (line, told) = port.line(command, None)?;
        goes_on = !told.contains_key(ENDED);
        options.print(command, &line, told, true)?;
    }
    Ok(())
}

/// Whether a command has one of these names, for whatever module.
fn is_one_of(names: &[&str], command: &str) -> bool {
    let words: Vec<&str> = command.split_whitespace().collect();
    let name = if words.first() == Some(&"module") { words.get(2) } else { words.first() };
    name.is_some_and(|name| names.contains(name))
}

impl Options {
    /// Prints a line that came while this command was carried out, or a field of it. `done` is false for the answer to
    /// a command that was refused.
    fn print(&self, command: &str, line: &str, told: Map<String, Value>, done: bool) -> Result<(), Failure> {
        let mut out = tell::out();
        match &self.value {
            None if self.text && done => write!(out, "{}", table(&told))?,
            None if !self.text => writeln!(out, "{line}")?,
            Some(field) if done => {
                if let Some(value) = field_of(told, field).map_err(Failure::Failed)? {
                    writeln!(out, "{value}")?;
                }
            }
            _ => {
                let why = told.get("error").and_then(Value::as_str).unwrap_or_default();
                tell::error(format_args!("{command}: {why}"))?;
            }
        }
        // A script may wait for each line.
        Ok(out.flush()?)
    }
}

/// An answer as people read it: a line for each field, and for a state first what all axes have in common, then a
/// column for each axis.
fn table(told: &Map<String, Value>) -> String {
    let axes: Vec<Vec<(String, String)>> = told
        .get(AXES)
        .and_then(Value::as_array)
        .map(|axes| axes.iter().filter_map(Value::as_object).map(|axis| fields(axis, "")).collect())
        .unwrap_or_default();
    let of_axis = axes.first().map_or(&[][..], Vec::as_slice);
    let common = told
        .iter()
        .filter(|(name, _)| *name != DONE && *name != AXES)
        .map(|(name, value)| (name.clone(), value.clone()));
    let common =
        fields(&common.collect(), "").into_iter().filter(|(name, _)| !of_axis.iter().any(|(other, _)| other == name));
    let mut rows: Vec<(String, Vec<String>)> = common.map(|(name, text)| (name, vec![text])).collect();
    let lone = rows.len();
    if !of_axis.is_empty() {
        rows.push(("axis".into(), (0..axes.len()).map(|number| number.to_string()).collect()));
        let column = |index: usize| {
            axes.iter().map(move |axis| axis.get(index).map(|(_, text)| text.clone()).unwrap_or_default())
        };
        rows.extend(of_axis.iter().enumerate().map(|(index, (name, _))| (name.clone(), column(index).collect())));
    }
    if rows.is_empty() {
        return "done\n".into();
    }
    let wide = rows.iter().map(|(name, _)| name.len()).max().unwrap_or_default();
    let cells = || rows.iter().skip(lone).flat_map(|(_, texts)| texts);
    let cell = cells().map(|text| text.chars().count()).max().unwrap_or_default();
    let line = |(index, (name, texts)): (usize, &(String, Vec<String>))| {
        let texts =
            texts.iter().map(|text| if index < lone { format!("  {text}") } else { format!("  {text:>cell$}") });
        format!("{name:wide$}{}\n", texts.collect::<String>())
    };
    rows.iter().enumerate().map(line).collect()
}

/// The fields of an object with their names for `--value`, those of objects in it as well.
fn fields(object: &Map<String, Value>, before: &str) -> Vec<(String, String)> {
    object
        .iter()
        .flat_map(|(name, value)| match value {
            Value::Object(inner) => fields(inner, &format!("{before}{name}.")),
            value => vec![(format!("{before}{name}"), text(value))],
        })
        .collect()
}

/// A value as people read it.
fn text(value: &Value) -> String {
    match value {
        Value::Bool(true) => "on".into(),
        Value::Bool(false) => "off".into(),
        Value::Null => "-".into(),
        Value::String(text) => text.clone(),
        Value::Array(list) => list.iter().map(text).collect::<Vec<_>>().join(" "),
        other => other.to_string(),
    }
}

/// A field of an answer as it is printed; `None` if the answer tells nothing, or if it only tells the time and that is
/// not asked for. The error lists the names there are.
fn field_of(answer: Map<String, Value>, path: &str) -> Result<Option<String>, String> {
    let is_asked_for = |key: &String| path.split('.').next() == Some(key);
    if answer.keys().all(|key| FOR_TIME.contains(&key.as_str())) && !answer.keys().any(is_asked_for) {
        return Ok(None);
    }
    let mut value = Value::Object(answer);
    for name in path.split('.') {
        let found = match &mut value {
            Value::Object(fields) => fields.get_mut(name),
            Value::Array(list) => name.parse().ok().and_then(|index: usize| list.get_mut(index)),
            _ => None,
        };
        value = match found {
            Some(found) => found.take(),
            None => return Err(format!("--value {path}: {}", missing(&value, name))),
        };
    }
    Ok(Some(match value {
        Value::String(text) => text,
        other => other.to_string(),
    }))
}

/// The message about a name that is none of the fields of a value.
fn missing(value: &Value, name: &str) -> String {
    match value {
        Value::Object(fields) => {
            let names = || fields.keys().map(String::as_str);
            let there_are: Vec<&str> = names().collect();
            match suggestion(name, names()) {
                none if none.is_empty() => format!("there is no field '{name}'; there are: {}", there_are.join(", ")),
                suggestion => format!("there is no field '{name}'{suggestion}"),
            }
        }
        Value::Array(list) if list.is_empty() => format!("there is no '{name}' in an empty list"),
        Value::Array(list) => format!("'{name}' is not a place in a list, 0 to {}", list.len() - 1),
        other => format!("there is no '{name}' in {other}, which is one value"),
    }
}

/// A connection to a control port.
pub(crate) struct Port {
    lines: BufReader<TcpStream>,
    timeout: Duration,
}

impl Port {
    /// Connects to a port. `timeout` is the longest wait for the connection, and for each answer.
    pub(crate) fn connect(address: &str, timeout: Duration) -> Result<Self, Failure> {
        let stream = tmcl_link::connect(address, timeout, "--control")?;
        let failed = |error: std::io::Error| Failure::Failed(format!("cannot use the connection: {}", words(error)));
        stream.set_write_timeout(Some(timeout)).map_err(failed)?;
        Ok(Port { lines: BufReader::new(stream), timeout })
    }

    /// Sends a command and gives the line that answers it, as it came and taken apart.
    pub(crate) fn ask(&mut self, command: &str) -> Result<(String, Map<String, Value>), Failure> {
        self.send(command)?;
        self.line(command, Some(self.timeout))
    }

    fn send(&mut self, command: &str) -> Result<(), Failure> {
        let sent = self.lines.get_mut().write_all(format!("{command}\n").as_bytes());
        sent.map_err(|error| failed(command, &Self::why(error, Some(self.timeout))))
    }

    /// The next line that comes, as it came and taken apart: the answer to this command, or a line of a watch. Without
    /// a `timeout` it is waited for without end.
    fn line(&mut self, command: &str, timeout: Option<Duration>) -> Result<(String, Map<String, Value>), Failure> {
        let mut bytes = Vec::new();
        let set = self.lines.get_ref().set_read_timeout(timeout);
        match set.and_then(|()| (&mut self.lines).take(LONGEST_ANSWER).read_until(b'\n', &mut bytes)) {
            Ok(0) => Err(failed(command, "the simulator has closed the connection")),
            Ok(_) => {
                let line = String::from_utf8_lossy(&bytes).trim_end().to_owned();
                let known = |told: &Map<String, Value>| MARKS.iter().any(|mark| told.contains_key(*mark));
                match serde_json::from_str(&line) {
                    Ok(Value::Object(told)) if known(&told) => Ok((line, told)),
                    _ => Err(failed(command, "what answers is not a control port; give the one of tmcl sim --control")),
                }
            }
            Err(error) => Err(failed(command, &Self::why(error, timeout))),
        }
    }

    /// True if the next line has come already.
    fn has_line(&self) -> bool {
        self.lines.buffer().contains(&b'\n')
    }

    fn why(error: std::io::Error, timeout: Option<Duration>) -> String {
        match (error.kind(), timeout) {
            (ErrorKind::WouldBlock | ErrorKind::TimedOut, Some(timeout)) => {
                format!("no answer within {} ms; is this the port of tmcl sim --control?", timeout.as_millis())
            }
            _ => format!("the connection failed: {}", words(error)),
        }
    }
}

fn failed(command: &str, why: &str) -> Failure {
    Failure::Failed(format!("{command}: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(text: &str, path: &str) -> Result<Option<String>, String> {
        field_of(serde_json::from_str(text).unwrap(), path)
    }

    #[test]
    fn a_field_is_found_by_its_path() {
        let state = r#"{"ok":true,"can":"on","supply":24.0,"axes":[{"velocity":-7},{"velocity":9}]}"#;
        for (path, value) in
            [("can", "on"), ("supply", "24.0"), ("axes.1.velocity", "9"), ("axes.0", r#"{"velocity":-7}"#)]
        {
            assert_eq!(field(state, path), Ok(Some(value.into())), "{path}");
        }
        assert_eq!(field(r#"{"ok":true}"#, "can"), Ok(None));
        assert_eq!(field(r#"{"ok":true,"time_us":7}"#, "can"), Ok(None));
        assert_eq!(field(r#"{"ok":true,"time_us":7}"#, "time_us"), Ok(Some("7".into())));
    }

    #[test]
    fn a_field_that_is_none_is_answered_with_those_there_are() {
        let state = r#"{"ok":true,"position":5,"axes":[{"velocity":-7}],"none":[]}"#;
        for (path, expected) in [
            ("positon", "--value positon: there is no field 'positon'; did you mean 'position'?"),
            ("x", "--value x: there is no field 'x'; there are: axes, none, ok, position"),
            ("axes.1", "--value axes.1: '1' is not a place in a list, 0 to 0"),
            ("none.0", "--value none.0: there is no '0' in an empty list"),
            ("position.0", "--value position.0: there is no '0' in 5, which is one value"),
        ] {
            assert_eq!(field(state, path), Err(expected.into()));
        }
    }

    #[test]
    fn addresses_and_commands_are_checked() {
        assert_eq!(address("tcp:127.0.0.1:4141"), Ok("127.0.0.1:4141".into()));
        assert!(["127.0.0.1", "127.0.0.1:0", ":1", ""].iter().all(|text| address(text).is_err()));
        assert!(command("press left").is_ok() && command("press left\nstate").is_err());
    }
}
