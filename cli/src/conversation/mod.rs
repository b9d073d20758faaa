//! A host's requests to one module and the decoded replies; refusals are errors.

mod answer;
mod reach;

pub use answer::Answer;
pub(crate) use answer::hexadecimal;
pub use reach::Reach;

use std::fmt;

use tmcm::module::Spec;
use tmcm::param::AxisParameter;
use tmcm::tmcl::binary::{Received, Telegram};
use tmcm::tmcl::{Command, Opcode, Status};

use crate::failure::Failure;
use crate::link::{Link, LinkError};
use crate::product::{PRODUCT, axis_number};

/// The reason why a command has failed, or why its outcome is unknown.
#[derive(Debug)]
pub enum Error {
    /// There is no reply.
    Link {
        /// The command that was sent.
        command: Command,
        /// The reason.
        error: LinkError,
    },
    /// The module has refused the command.
    Refused {
        /// The command that was sent.
        command: Command,
        /// The status of the reply.
        status: u8,
    },
    /// The reply belongs to another command, or its checksum is wrong.
    Strange {
        /// The command that was sent.
        command: Command,
        /// The nine bytes that came.
        reply: Telegram,
    },
}

impl Error {
    /// True if the module has refused the command with this status.
    pub fn is(&self, refusal: Status) -> bool {
        matches!(self, Error::Refused { status, .. } if *status == refusal as u8)
    }

    /// True if the module has refused the command with any status.
    pub fn is_refusal(&self) -> bool {
        matches!(self, Error::Refused { .. })
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Link { command, error } => write!(f, "{command}: {error}"),
            Error::Refused { command, status } => {
                write!(f, "{command}: status {status} {}", meaning(*status))
            }
            Error::Strange { command, reply } => {
                write!(f, "{command}: what came is not the reply to it: {}", hexadecimal(reply))
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Failure::Failed(error.to_string())
    }
}

/// True for the statuses of a command that was executed or stored in program memory.
pub(crate) fn executed(status: u8) -> bool {
    matches!(Status::from_number(status), Some(Status::Ok | Status::Loaded))
}

/// The meaning of a status in words.
pub(crate) fn meaning(status: u8) -> &'static str {
    Status::from_number(status).map_or("a status this program does not know", Status::meaning)
}

/// The host's side of a conversation with a module.
#[derive(Debug)]
pub struct Conversation {
    link: Link,
    spec: &'static Spec,
    /// The module's address (1..=255), or its CAN identifier (0..=2047). It may be changed at any time.
    pub address: u16,
}

impl Conversation {
    /// Opens the link to the module that the options name.
    pub fn open(reach: &Reach) -> Result<Self, Failure> {
        Ok(Self::new(Link::open(&reach.link, reach.baud, reach.patience())?, reach.address))
    }

    /// A conversation over an open link with the module at `address`.
    pub fn new(link: Link, address: u16) -> Self {
        Conversation { link, spec: PRODUCT, address }
    }

    /// The product whose parameters the module is assumed to have.
    pub fn spec(&self) -> &'static Spec {
        self.spec
    }

    /// Sends a command and returns the nine bytes of its reply undecoded.
    pub fn exchange(&mut self, command: Command) -> Result<Telegram, LinkError> {
        self.link.exchange(self.address, command)
    }

    /// Sends a command and passes the reply to `wanted`, which returns `None` for a reply of another form.
    fn ask<T>(&mut self, command: Command, wanted: impl FnOnce(Answer) -> Option<T>) -> Result<T, Error> {
        let reply = self.exchange(command).map_err(|error| Error::Link { command, error })?;
        match Answer::read(command, &reply) {
            Answer::Plain(Received { status, .. }) if !executed(status) => Err(Error::Refused { command, status }),
            answer => wanted(answer).ok_or(Error::Strange { command, reply }),
        }
    }

    /// Sends a command that must be executed, or stored in program memory.
    pub fn request(&mut self, command: Command) -> Result<Received, Error> {
        self.ask(command, |answer| match answer {
            Answer::Plain(reply) => Some(reply),
            _ => None,
        })
    }

    /// Sends a command and returns the value of the reply.
    pub fn value(&mut self, command: Command) -> Result<i32, Error> {
        Ok(self.request(command)?.value)
    }

    /// The value of an axis parameter. If the product does not have the parameter, the unused number 255 is asked for,
    /// so that the module refuses the command.
    pub fn axis(&mut self, axis: u8, parameter: AxisParameter) -> Result<i32, Error> {
        let number = axis_number(self.spec, parameter).unwrap_or(u8::MAX);
        self.value(Command::new(Opcode::Gap as u8, number, axis, 0))
    }

    /// Sends a control command (manual section 3.7.38), which has no motor or bank, and returns the value of the reply.
    pub fn control(&mut self, opcode: Opcode, kind: u8, value: i32) -> Result<i32, Error> {
        self.value(Command::new(opcode as u8, kind, 0, value))
    }

    /// The command at an address of program memory (command 134).
    pub fn memory(&mut self, address: u16) -> Result<Command, Error> {
        let command = Command::new(Opcode::ReadMemory as u8, 0, 0, address.into());
        self.ask(command, |answer| match answer {
            Answer::Memory(stored) => Some(stored),
            _ => None,
        })
    }

    /// The version string (command 136, type 0).
    pub fn version(&mut self) -> Result<String, Error> {
        let command = Command::new(Opcode::FirmwareVersion as u8, 0, 0, 0);
        self.ask(command, |answer| match answer {
            Answer::Version(text) => Some(text),
            _ => None,
        })
    }

    /// The number of axes of the module, found by asking for axis after axis until the module refuses the number.
    pub fn axes(&mut self) -> Result<u8, Error> {
        let mut axes = 0;
        loop {
            match self.axis(axes, AxisParameter::ActualPosition) {
                Ok(_) if axes < u8::MAX => axes += 1,
                Err(error) if !error.is_refusal() || axes == 0 => return Err(error),
                Ok(_) | Err(_) => return Ok(axes),
            }
        }
    }
}
