//! A host's requests to one module and the decoded replies; refusals are errors.

mod identity;

pub use identity::Identity;

use std::fmt;
use std::time::Duration;

use tmcm::param::AxisParameter;
use tmcm::tmcl::binary::{Received, Telegram};
use tmcm::tmcl::{Command, Opcode, Status};
use tmcm_sim::NativeModule;
use tmcm_sim::wire::{Answer, executed, hexadecimal, meaning};

use crate::failure::Failure;
use crate::product::{Product, axis_number, numbers, read_unit_mode, short, speed_unit, symbol, with_unit};
use crate::stop::Stop;
use crate::wire::{LinkError, Wire};

/// The reason why a command has failed, or why its outcome is unknown.
#[derive(Debug)]
pub enum Error {
    /// No reply has come.
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
    /// The module is a product that is not known here.
    Unknown {
        /// The number of the product.
        number: u16,
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
            Error::Unknown { number } => write!(
                f,
                "a TMCM-{number} is not known here; use numbers, or name a known product that has its parameters"
            ),
            Error::Strange { command, reply } => {
                let reply = hexadecimal(reply);
                write!(
                    f,
                    "{command}: what came is not the reply to it: {reply}; is there a module, and is the bit rate right?"
                )
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match error {
            Error::Link { error: LinkError::Interrupted { signal }, .. } => {
                Failure::Interrupted { signal, message: String::new() }
            }
            error => Failure::Failed(error.to_string()),
        }
    }
}

/// Command 136, type 1: the module tells its product and the version of its firmware as a number.
pub const ASK_VERSION: Command = Command::new(Opcode::FirmwareVersion as u8, 1, 0, 0);

/// The host's side of a conversation with a module.
pub struct Conversation {
    wire: Box<dyn Wire>,
    /// The identity of the module; `None` as long as nobody has needed it.
    identity: Option<Identity>,
    address: u16,
    /// Takes what the user has to know of the module.
    tell: fn(&str),
}

impl Conversation {
    /// A conversation over an open link with the module at `address`: 1..=255, or a CAN identifier, 0..=2047.
    /// `identity` is what it is, if that is known; `tell` takes sentences that the user has to know.
    pub fn new(wire: Box<dyn Wire>, address: u16, identity: Option<Identity>, tell: fn(&str)) -> Self {
        Conversation { wire, identity, address, tell }
    }

    /// Time since the link was opened: that of the clock on the wall, of a virtual module its virtual time.
    pub fn time(&self) -> Duration {
        self.wire.time()
    }

    /// Sets the longest wait for a reply.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.wire.set_timeout(timeout);
    }

    /// Lets time pass for the module, or until `stop` is asked. True if it has been asked.
    pub fn pause(&mut self, time: Duration, stop: &dyn Stop) -> bool {
        self.wire.pause(time, stop)
    }

    /// The virtual module inside this program, if the link leads to one.
    pub fn simulated(&mut self) -> Option<&mut NativeModule> {
        self.wire.simulated()
    }

    /// Tells the user a sentence.
    pub fn tell(&self, text: &str) {
        (self.tell)(text);
    }

    /// Goes on with the module at another address.
    pub fn turn_to(&mut self, address: u16) {
        self.identity = None;
        self.address = address;
    }

    /// Finds out what the module is: what the user has named, or else what the module tells. The module is asked when
    /// this is needed for the first time. The user is told of a product that is not known here, and of a module that
    /// does not tell what it is, which is taken for a TMCM-1140.
    ///
    /// # Errors
    /// The link has failed.
    pub fn identity(&mut self) -> Result<Identity, Error> {
        if let Some(identity) = self.identity {
            return Ok(identity);
        }
        let usual = Product::default();
        let name = usual.name();
        let (identity, note) = match self.value(ASK_VERSION).map(Identity::told) {
            Ok(told @ Identity { number, product: None, .. }) => {
                let what = format!("a TMCM-{number}, which is not known here: its values are shown as numbers");
                (told, Some(format!("this module is {what}; --product {} takes it for a {name}", short(usual))))
            }
            Ok(told) => (told, None),
            Err(
                Error::Link { error: LinkError::NoReply { .. }, .. } | Error::Refused { .. } | Error::Strange { .. },
            ) => {
                let what = "does not tell what it is (command 136)";
                let note = format!("this module {what}: it is taken for a {name}, unless --product names another one");
                (Identity::from(usual), Some(note))
            }
            Err(error) => return Err(error),
        };
        if let Some(note) = note {
            (self.tell)(&note);
        }
        self.identity = Some(identity);
        Ok(identity)
    }

    /// The product of the module, `None` for one that is not known here.
    ///
    /// # Errors
    /// The link has failed.
    pub fn product(&mut self) -> Result<Option<Product>, Error> {
        Ok(self.identity()?.product)
    }

    /// The product of the module, which must be one that is known here.
    ///
    /// # Errors
    /// The link has failed, or the module is something else.
    pub fn known_product(&mut self) -> Result<Product, Error> {
        let Identity { product, number, .. } = self.identity()?;
        product.ok_or(Error::Unknown { number })
    }

    /// Sends a command and returns the nine bytes of its reply undecoded.
    pub fn exchange(&mut self, command: Command) -> Result<Telegram, LinkError> {
        self.wire.exchange(self.address, command)
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

    /// The value of an axis parameter. If the product does not have the parameter, a number is asked for that it has no
    /// parameter for, so that the module refuses the command.
    pub fn axis(&mut self, axis: u8, parameter: AxisParameter) -> Result<i32, Error> {
        let product = self.product()?;
        let unused = || (0..=u8::MAX).rev().find(|number| numbers(product).axis.find(*number).is_none());
        let number = axis_number(product, parameter).or_else(unused).unwrap_or(u8::MAX);
        self.value(Command::new(Opcode::Gap as u8, number, axis, 0))
    }

    /// Whether an axis has its speeds and accelerations in units of its chip now.
    pub fn is_in_chip_units(&mut self, axis: u8) -> Result<bool, Error> {
        match read_unit_mode(self.product()?, axis) {
            Some(command) => Ok(self.value(command)? == 0),
            None => Ok(false),
        }
    }

    /// A speed of an axis with its unit, if the product is known.
    pub fn speed(&mut self, axis: u8) -> Result<(i32, String), Error> {
        let speed = self.axis(axis, AxisParameter::ActualSpeed)?;
        let in_chip = self.is_in_chip_units(axis)?;
        let unit = self.product()?.map_or("", |product| symbol(speed_unit(product), in_chip));
        Ok((speed, with_unit(speed, unit)))
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

    /// The message about an axis that the module does not have; `None` if it has it.
    pub fn no_such_axis(&mut self, axis: u8) -> Result<Option<String>, Error> {
        match self.axis(axis, AxisParameter::ActualPosition) {
            Err(error) if error.is_refusal() => {}
            answered => return answered.map(|_| None),
        }
        let axes = self.axes()?;
        let there_are = if axes == 1 { "axis 0 only".into() } else { format!("axes 0 to {}", axes.saturating_sub(1)) };
        Ok((axis >= axes).then(|| format!("axis {axis}: the module has {there_are}")))
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

#[cfg(test)]
mod tests;
