//! What is asked at the doors, and what is told. `studio/page/types.js` has the same types for the page, which a test compares.

use serde::{Deserialize, Serialize};
use tmcl_tools::wire::LinkError;
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;

/// Nothing is asked but the door itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nothing {}

/// A command for the module at an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// The address, 0 to 255.
    pub address: u16,
    /// The number of the command.
    pub opcode: u8,
    /// Its type.
    pub kind: u8,
    /// Its motor or bank.
    pub motor: u8,
    /// Its value.
    pub value: i32,
}

impl Request {
    /// A command for the module at this address.
    pub fn new(address: u16, command: Command) -> Self {
        let Command { opcode, kind, motor, value } = command;
        Request { address, opcode, kind, motor, value }
    }

    /// The command.
    pub fn command(&self) -> Command {
        Command::new(self.opcode, self.kind, self.motor, self.value)
    }
}

/// A request of the tools to a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exchange {
    /// What is asked.
    pub request: Request,
    /// The longest wait for the reply, in milliseconds.
    pub timeout: u32,
}

/// What has become of a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Outcome {
    /// The nine bytes of the reply.
    Reply(Vec<u8>),
    /// No complete reply has come in time; so many bytes have.
    NoReply(usize),
    /// Only modules at these addresses have replied.
    Others {
        /// The address that was asked.
        asked: u8,
        /// Those that answered.
        answered: Vec<u8>,
    },
    /// The address is above 255.
    Address,
    /// The link is gone: how, in words.
    Lost(String),
    /// It has been asked to end.
    Interrupted,
}

impl From<Result<Telegram, LinkError>> for Outcome {
    fn from(result: Result<Telegram, LinkError>) -> Self {
        match result {
            Ok(reply) => Outcome::Reply(reply.into()),
            Err(LinkError::NoReply { bytes }) => Outcome::NoReply(bytes),
            Err(LinkError::Others { asked, answered }) => Outcome::Others { asked, answered },
            Err(LinkError::Address) => Outcome::Address,
            Err(LinkError::Interrupted { .. }) => Outcome::Interrupted,
            Err(error) => Outcome::Lost(error.to_string()),
        }
    }
}

impl From<Outcome> for Result<Telegram, LinkError> {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Reply(bytes) => {
                bytes.try_into().map_err(|bytes: Vec<u8>| LinkError::NoReply { bytes: bytes.len() })
            }
            Outcome::NoReply(bytes) => Err(LinkError::NoReply { bytes }),
            Outcome::Others { asked, answered } => Err(LinkError::Others { asked, answered }),
            Outcome::Address => Err(LinkError::Address),
            Outcome::Lost(how) => Err(LinkError::Lost(how)),
            Outcome::Interrupted => Err(LinkError::Interrupted { signal: 0 }),
        }
    }
}

/// Which virtual module is wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// The product, such as 1140.
    pub product: String,
}

/// A line for the control port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// The line, without its end.
    pub line: String,
}

/// A request that a virtual module has taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ticket {
    /// Its number.
    pub ticket: u32,
}

/// What has come of a turn of a virtual module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// Requests that are over.
    pub replies: Vec<Finished>,
    /// Lines of the control port: answers, and lines of a watch.
    pub lines: Vec<String>,
    /// What a person should be told.
    pub messages: Vec<String>,
    /// After how many milliseconds there is something to do again.
    pub nap: f64,
}

/// A request of a virtual module that is over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finished {
    /// Its number.
    pub ticket: u32,
    /// What has become of it.
    pub outcome: Outcome,
}

/// Bytes of a stream.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bytes {
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// What bytes of a stream have led to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Taken {
    /// How the request ends; null as long as more bytes have to come.
    pub outcome: Option<Outcome>,
}

/// The axes of a module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// The address of the module.
    pub address: u16,
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
}

/// A request that may have set something in motion.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moved {
    /// The request.
    pub request: Request,
    /// The product of the module, such as 1140; null for one that is not known.
    pub product: Option<String>,
}

/// What a link has to know of a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noted {
    /// What stops what it sets in motion.
    pub stops: Vec<Request>,
    /// What becomes of download mode.
    pub download: Download,
}

/// What a request makes of download mode, in which a module stores commands and does not carry them out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Download {
    /// Nothing.
    Same,
    /// It is over.
    Over,
    /// It begins.
    Begun {
        /// What ends it.
        end: Request,
        /// What leaves nothing of a program that is broken off, behind the end.
        clear: Vec<Request>,
    },
}

/// Requests to be sent one after the other.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Requests {
    /// The requests.
    pub requests: Vec<Request>,
}

/// Values that are read again and again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Columns {
    /// One behind the other.
    pub columns: Vec<Column>,
}

/// A value that is read again and again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Its name, with its axis.
    pub name: String,
    /// Its unit, which may be empty.
    pub unit: String,
    /// How it is read.
    pub request: Request,
}

/// A reply that may have a value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Read {
    /// What was asked.
    pub request: Request,
    /// What has become of it.
    pub outcome: Outcome,
}

/// A value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Value {
    /// The value; null if there is none.
    pub value: Option<i32>,
}

/// Values of columns, in their order; null where there is none.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Values {
    /// The values.
    pub values: Vec<Option<i32>>,
}

/// Where the module of the tools is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reach {
    /// Its address, 0 to 255.
    pub address: u16,
    /// The longest wait for a reply, in milliseconds.
    pub timeout: u32,
}

/// What a module has told of itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Module {
    /// Its name and the version of its firmware, for people.
    pub name: String,
    /// The product, such as 1140; null for one that is not known, which is commanded all the same.
    pub product: Option<String>,
}

/// The products that there are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Products {
    /// Their short names, such as 1140, the usual one first.
    pub products: Vec<String>,
}

/// Something to be shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Text {
    /// The text.
    pub text: String,
    /// False if the module has refused what was asked.
    pub done: bool,
}

/// A program for the module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// Its name in messages.
    pub name: String,
    /// Its source.
    pub text: String,
    /// Lines for the debugger, which the program is given to when it is loaded.
    pub debug: Vec<String>,
}

/// How far a job has got.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Progress {
    /// What is under way.
    pub what: String,
    /// Number of steps that are done.
    pub done: usize,
    /// Number of steps in all; 0 while no job tells.
    pub total: usize,
}

/// How a door answers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Answer<T> {
    /// What was asked for.
    Ok(T),
    /// Why there is nothing, for the user.
    Error(String),
    /// It has been asked to end, with what the user has to know about that; it may be empty.
    Interrupted(String),
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use serde_json::{Value as Json, json};

    use super::*;

    /// The types of the page, by their names.
    fn page() -> BTreeMap<&'static str, &'static str> {
        let defined = |line: &'static str| {
            let (kind, name) = line.strip_prefix("/** @typedef {")?.strip_suffix(" */")?.rsplit_once("} ")?;
            Some((name, kind.trim()))
        };
        include_str!("../page/types.js").lines().filter_map(defined).collect()
    }

    /// The parts of a text between separators that stand outside of braces.
    fn parts(text: &str, separator: char) -> Vec<&str> {
        let (mut depth, mut from, mut parts) = (0, 0, Vec::new());
        for (at, c) in text.char_indices() {
            depth += i32::from("{(".contains(c)) - i32::from("})".contains(c));
            if c == separator && depth == 0 {
                parts.push(text[from..at].trim());
                from = at + 1;
            }
        }
        parts.push(text[from..].trim());
        parts
    }

    /// Whether a value is of a type of the page, with all fields and no others; notes the alternatives that were used.
    fn fits<'a>(kind: &'a str, value: &Json, types: &BTreeMap<&str, &'a str>, used: &mut BTreeSet<&'a str>) -> bool {
        let alternatives = parts(kind, '|');
        if alternatives.len() > 1 {
            let found = alternatives.into_iter().find(|kind| fits(kind, value, types, used));
            used.extend(found);
            return found.is_some();
        }
        match (kind, value) {
            ("null", Json::Null)
            | ("number", Json::Number(_))
            | ("string", Json::String(_))
            | ("boolean", Json::Bool(_)) => true,
            (_, Json::Array(list)) if kind.ends_with("[]") => {
                !list.is_empty()
                    && list
                        .iter()
                        .all(|value| fits(kind.trim_end_matches("[]").trim_matches(['(', ')']), value, types, used))
            }
            (_, Json::Object(fields)) if kind.starts_with('{') => {
                let inner = kind.trim_start_matches('{').trim_end_matches('}');
                let expected: Vec<(&str, &str)> =
                    parts(inner, ',').iter().filter_map(|field| field.split_once(": ")).collect();
                expected.len() == fields.len()
                    && expected
                        .iter()
                        .all(|(name, kind)| fields.get(*name).is_some_and(|value| fits(kind, value, types, used)))
            }
            (_, Json::String(text)) if kind.starts_with('\'') => kind.trim_matches('\'') == text,
            _ => types.get(kind).is_some_and(|kind| fits(kind, value, types, used)),
        }
    }

    #[test]
    fn the_page_has_the_same_types() {
        let request = Request::new(1, Command::new(6, 1, 0, 0));
        let outcomes = [
            Outcome::Reply(vec![0; 9]),
            Outcome::NoReply(3),
            Outcome::Others { asked: 1, answered: vec![2] },
            Outcome::Address,
            Outcome::Lost("gone".into()),
            Outcome::Interrupted,
        ];
        let column = Column { name: "speed 0".into(), unit: "pps".into(), request };
        let products = [Some(String::from("1140")), None];
        let mut examples = vec![
            ("Request", json!(request)),
            ("Exchange", json!(Exchange { request, timeout: 1000 })),
            ("Start", json!(Start { product: "1140".into() })),
            ("Line", json!(Line { line: "state".into() })),
            ("Ticket", json!(Ticket { ticket: 1 })),
            ("Bytes", json!(Bytes { bytes: vec![1] })),
            ("Taken", json!(Taken { outcome: None })),
            ("Requests", json!(Requests { requests: vec![request] })),
            ("Columns", json!(Columns { columns: vec![column.clone()] })),
            ("Column", json!(column)),
            ("Value", json!(Value { value: Some(1) })),
            ("Value", json!(Value { value: None })),
            ("Values", json!(Values { values: vec![Some(1), None] })),
            ("Reach", json!(Reach { address: 1, timeout: 1000 })),
            ("Products", json!(Products { products: vec!["1140".into()] })),
            ("Text", json!(Text { text: "done".into(), done: true })),
            ("Program", json!(Program { name: "a.tmc".into(), text: "STOP".into(), debug: vec!["step".into()] })),
            ("Progress", json!(Progress::default())),
            ("Answer", json!(Answer::<Nothing>::Error("no".into()))),
            ("Answer", json!(Answer::<Nothing>::Interrupted(String::new()))),
        ];
        let begun = Download::Begun { end: request, clear: vec![request] };
        for download in [Download::Same, Download::Over, begun] {
            examples.push(("Download", json!(download)));
            examples.push(("Noted", json!(Noted { stops: vec![request], download })));
        }
        for outcome in outcomes {
            let finished = Finished { ticket: 1, outcome: outcome.clone() };
            let (lines, messages) = (vec!["{}".into()], vec!["warning".into()]);
            examples.push(("Outcome", json!(outcome)));
            examples.push(("Read", json!(Read { request, outcome: outcome.clone() })));
            examples.push(("Taken", json!(Taken { outcome: Some(outcome) })));
            examples.push(("Finished", json!(finished)));
            examples.push(("Turn", json!(Turn { replies: vec![finished], lines, messages, nap: 1.5 })));
        }
        for product in products {
            examples.push(("Axes", json!(Axes { address: 1, product: product.clone() })));
            examples.push(("Moved", json!(Moved { request, product: product.clone() })));
            examples.push(("Module", json!(Module { name: "TMCM-1140".into(), product })));
        }
        let types = page();
        let (mut used, mut seen) = (BTreeSet::new(), BTreeSet::new());
        for (name, value) in &examples {
            let kind = types.get(name).unwrap_or_else(|| panic!("the page has no {name}"));
            assert!(fits(kind, value, &types, &mut used), "{name}: {kind}, and not {value}");
            seen.insert(*name);
        }
        assert_eq!(types.keys().copied().collect::<BTreeSet<_>>(), seen, "the page has others");
        let alternatives = types.values().flat_map(|kind| parts(kind, '|')).filter(|kind| !kind.contains("any"));
        let unions: BTreeSet<&str> =
            types.values().filter(|kind| parts(kind, '|').len() > 1).flat_map(|kind| parts(kind, '|')).collect();
        assert!(
            alternatives.filter(|kind| unions.contains(kind)).all(|kind| used.contains(kind)),
            "{unions:?} {used:?}"
        );
        // What is not so is noticed.
        let fits = |kind, value| fits(kind, &value, &types, &mut BTreeSet::new());
        assert!(!fits("Ticket", json!({ "ticket": "1" })) && !fits("Ticket", json!({ "ticket": 1, "more": 1 })));
        assert!(
            !fits("Ticket", json!({})) && !fits("Outcome", json!("gone")) && !fits("Value", json!({ "value": "x" }))
        );
    }
}
