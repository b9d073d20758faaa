//! Types of what is asked at the doors, and of what is told. `studio/page/types.js` has the same types for the page,
//! which a test compares.

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
    /// The type of the command.
    pub kind: u8,
    /// The motor or bank of the command.
    pub motor: u8,
    /// The value of the command.
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
    /// The request.
    pub request: Request,
    /// The longest wait for the reply, in milliseconds.
    pub timeout: u32,
}

/// The outcome of a request.
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
        /// The addresses of the modules that answered.
        answered: Vec<u8>,
    },
    /// The address is above 255.
    Address,
    /// The link is gone: how, in words.
    Lost(String),
    /// The request was broken off: its end has been asked for.
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

/// The virtual module that is wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// The product, such as 1140.
    pub product: String,
    /// The world of the module, a text of `tmcl sim --world`; null for the usual one.
    pub world: Option<String>,
    /// The contents of the module's EEPROM, two hexadecimal digits for each byte; null as it leaves the factory.
    pub eeprom: Option<String>,
}

/// A virtual module to which things are done that were done to another one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Play {
    /// The module.
    pub start: Start,
    /// The deeds, as in a session.
    pub done: Vec<String>,
    /// When time stands still, in microseconds of the module's time.
    pub until: u64,
}

/// The text of a world that is looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldText {
    /// The text.
    pub text: String,
    /// The product that is to stand in it, such as 1140.
    pub product: String,
}

/// The contents of an EEPROM.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contents {
    /// Two hexadecimal digits for each byte.
    pub eeprom: String,
}

/// A flash image of the TMCL firmware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Image {
    /// The product that it is for, such as 1140; null if it does not tell, as other people's images do not.
    pub product: Option<String>,
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
    /// The number of the request.
    pub ticket: u32,
}

/// A line of the control port for the page.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineTold {
    /// The number of the line that it answers; null for one of a watch.
    pub ticket: Option<u32>,
    /// The line, without its end.
    pub line: String,
}

/// The outcome of a turn of a virtual module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// Requests that are over.
    pub replies: Vec<Finished>,
    /// Lines of the control port: answers, and lines of a watch.
    pub lines: Vec<LineTold>,
    /// Messages that a person should be told.
    pub messages: Vec<String>,
    /// Rows of the values that are watched.
    pub rows: Vec<SampleRow>,
    /// Whether its time is paused.
    pub paused: bool,
    /// Whether it has power.
    pub powered: bool,
    /// How often it has begun anew.
    pub starts: u32,
    /// Why the module cannot go on, in words; null while it can. Then its time stands still for good.
    pub stopped: Option<String>,
    /// How often a page of its EEPROM has been written.
    pub stored: u32,
    /// How many milliseconds are left of a session that is done again; null if none is, or somebody has taken over.
    pub left: Option<f64>,
    /// After how many milliseconds there is something to do again.
    pub nap: f64,
}

/// Values of a moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampleRow {
    /// The moment, in milliseconds.
    pub at: f64,
    /// The values; null where there is none.
    pub values: Vec<Option<f64>>,
}

/// A request of a virtual module that is over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finished {
    /// The number of the request.
    pub ticket: u32,
    /// The outcome of the request.
    pub outcome: Outcome,
}

/// Bytes of a stream.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bytes {
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// The outcome of bytes of a stream.
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

/// Facts about a request that a link has to know.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noted {
    /// The requests that stop what it sets in motion.
    pub stops: Vec<Request>,
    /// The effect on download mode.
    pub download: Download,
}

/// The effect of a request on download mode, in which a module stores commands and does not carry them out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Download {
    /// Nothing.
    Same,
    /// The mode is over.
    Over,
    /// The mode begins.
    Begun {
        /// The request that ends the mode.
        end: Request,
        /// The requests that leave nothing of a program that is broken off, behind the end.
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

/// A reply that may have a value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Read {
    /// The request.
    pub request: Request,
    /// The outcome of the request.
    pub outcome: Outcome,
}

/// A value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Value {
    /// The value; null if there is none.
    pub value: Option<i32>,
}

/// Where the module of the tools is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reach {
    /// The address of the module, 0 to 255.
    pub address: u16,
    /// The longest wait for a reply, in milliseconds.
    pub timeout: u32,
}

/// Facts that a module has told of itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Module {
    /// The name of the module and the version of its firmware, for people.
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

/// How far a job has got.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Progress {
    /// The work that is under way, in words.
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
    /// The value that was asked for.
    Ok(T),
    /// Why there is nothing, for the user.
    Error(String),
    /// The work was broken off: its end has been asked for. The text is what the user has to know about that; it may be
    /// empty.
    Interrupted(String),
}
