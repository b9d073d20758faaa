//! `tmcl world`: commands to the control port of `tmcl sim`, as a script or a hand gives them.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use clap::Args;
use serde_json::{Map, Value};

use crate::failure::Failure;
use crate::link;
use crate::sim;
use crate::suggest::suggestion;
use crate::wording::words;

/// Longest answer in bytes; a state of six axes has some three thousand.
const LONGEST_ANSWER: u64 = 1 << 20;
/// The field that says whether a command was carried out.
const DONE: &str = "ok";
/// The command without any.
const STATE: &str = "state";

/// Change the world around a virtual module, and look at it: switches, loads, faults, supply
///
/// Sends commands to the control port of `tmcl sim --control ADDR:PORT`, one after the other, and prints the answer to
/// each, a line of JSON. docs/control.md has all commands, faults, and fields of a state; the module itself is asked by
/// `tmcl send`.
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

    /// How long to wait for each answer, in milliseconds
    #[arg(long, value_name = "MS", default_value_t = 5000, value_parser = clap::value_parser!(u64).range(1..=600_000))]
    pub timeout: u64,
}

const EXAMPLES: &str = "\
Examples:
  tmcl world 127.0.0.1:4141                             the state of the module
  tmcl world 127.0.0.1:4141 \"press left\"                a switch by hand
  tmcl world 127.0.0.1:4141 \"load 0.5 2\" state          a load on axis 2, and what comes of it
  tmcl world 127.0.0.1:4141 state --value axes.0.rotor  a number for a script
The exit code is 1 if a command was refused.";

/// Reads the address of the port.
pub(crate) fn address(text: &str) -> Result<String, String> {
    let address = sim::address(text.strip_prefix("tcp:").unwrap_or(text))?;
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
    let mut port = Port::connect(&options.address, Duration::from_millis(options.timeout))?;
    let mut out = std::io::stdout().lock();
    let mut all_done = true;
    for command in &options.commands {
        let (line, answer) = port.ask(command)?;
        let done = answer.get(DONE) == Some(&Value::Bool(true));
        all_done &= done;
        match &options.value {
            None => writeln!(out, "{line}")?,
            Some(field) if done => {
                if let Some(value) = field_of(answer, field).map_err(Failure::Failed)? {
                    writeln!(out, "{value}")?;
                }
            }
            Some(_) => {
                let why = answer.get("error").and_then(Value::as_str).unwrap_or_default();
                writeln!(std::io::stderr(), "tmcl: {command}: {why}")?;
            }
        }
        // A script may wait for each line.
        out.flush()?;
    }
    if all_done { Ok(()) } else { Err(Failure::Reported) }
}

/// A field of an answer as it is printed; `None` if the answer tells nothing. The error lists the names there are.
fn field_of(answer: Map<String, Value>, path: &str) -> Result<Option<String>, String> {
    if answer.keys().all(|key| key == DONE) {
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

/// What to say of a name that is none of the fields of a value.
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
        let stream = link::connect(address, timeout, "--control")?;
        let failed = |error: std::io::Error| Failure::Failed(format!("cannot use the connection: {}", words(error)));
        stream.set_read_timeout(Some(timeout)).map_err(failed)?;
        stream.set_write_timeout(Some(timeout)).map_err(failed)?;
        Ok(Port { lines: BufReader::new(stream), timeout })
    }

    /// Sends a command and gives the line that answers it, as it came and taken apart.
    pub(crate) fn ask(&mut self, command: &str) -> Result<(String, Map<String, Value>), Failure> {
        let failed = |why: String| Failure::Failed(format!("{command}: {why}"));
        let mut bytes = Vec::new();
        let sent = self.lines.get_mut().write_all(format!("{command}\n").as_bytes());
        let read = sent.and_then(|()| (&mut self.lines).take(LONGEST_ANSWER).read_until(b'\n', &mut bytes));
        match read {
            Ok(0) => Err(failed("the simulator has closed the connection".into())),
            Ok(_) => {
                let line = String::from_utf8_lossy(&bytes).trim_end().to_owned();
                match serde_json::from_str(&line) {
                    Ok(Value::Object(answer)) if answer.contains_key(DONE) => Ok((line, answer)),
                    _ => Err(failed("what answers is not a control port; give the one of tmcl sim --control".into())),
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Err(failed(format!(
                "no answer within {} ms; is this the port of tmcl sim --control?",
                self.timeout.as_millis()
            ))),
            Err(error) => Err(failed(format!("the connection failed: {}", words(error)))),
        }
    }
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
