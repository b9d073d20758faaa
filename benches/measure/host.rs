//! A host that talks to the module on one of its links, and times it.

use std::error::Error;

use hal_sim::board::Board;
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::mcu::{Machine, Step};
use hal_sim::world::config::WorldConfig;
use tmcm::tmcl::binary::{self, Received};
use tmcm::tmcl::{Command, text};

/// Anything that ends a measurement.
pub(crate) type Failure = Box<dyn Error>;

/// Core cycles of a microsecond.
pub(crate) const CYCLES_PER_MICROSECOND: u64 = 168;

/// How long a host waits for a reply.
const PATIENCE: Nanos = 2 * SECOND;
/// Time for the firmware to start.
const START: Nanos = 100 * MILLISECOND;
/// The factory default of RS485.
const BAUD: u32 = 9_600;

/// A request and its reply.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exchange {
    /// When the module had the last bit of the request.
    pub(crate) asked: Nanos,
    /// When the first bit of the reply went out.
    pub(crate) answered: Nanos,
    /// The reply.
    pub(crate) reply: Received,
}

impl Exchange {
    /// Core cycles from the last bit in to the first bit out.
    pub(crate) fn cycles(&self) -> u64 {
        cycles(self.answered - self.asked)
    }
}

/// The core cycles of a span of virtual time.
pub(crate) fn cycles(span: Nanos) -> u64 {
    span * CYCLES_PER_MICROSECOND / 1_000
}

/// A command in its written form.
pub(crate) fn command(line: &str) -> Result<Command, Failure> {
    text::parse(line).map_err(|error| error.to_string().into())
}

/// A module and the host.
pub(crate) struct Host {
    pub(crate) machine: Machine,
}

impl Host {
    /// Switches on a module with the image `elf`.
    pub(crate) fn start(elf: &[u8]) -> Result<Self, Failure> {
        let board = Board::new(&WorldConfig::default(), 0);
        let mut host = Self { machine: Machine::new(elf, board)? };
        host.run(START)?;
        Ok(host)
    }

    /// Lets time pass.
    pub(crate) fn run(&mut self, span: Nanos) -> Result<(), Failure> {
        Ok(self.machine.run(span)?)
    }

    /// Sends a command and waits for the reply, with an eye on the core from the last bit of the request on.
    pub(crate) fn observe(&mut self, command: Command, observer: &mut dyn FnMut(Step)) -> Result<Exchange, Failure> {
        let telegram = binary::encode_command(1, command);
        let end = self.machine.send(self.machine.now(), &telegram, BAUD);
        // The receiver knows a byte in the middle of its stop bit.
        let asked = end - SECOND / Nanos::from(BAUD) / 2;
        self.machine.run_until(asked)?;
        let mut sent = Vec::new();
        while sent.len() < telegram.len() {
            let now = self.machine.now();
            if now > end + PATIENCE {
                return Err(format!("no reply to {command}: {:?}", self.machine.take_log()).into());
            }
            self.machine.observe_until(now + MILLISECOND, observer)?;
            sent.extend(self.machine.take_sent());
        }
        let bytes: Vec<u8> = sent.iter().map(|character| character.value).collect();
        let reply = <&binary::Telegram>::try_from(bytes.as_slice()).ok().and_then(binary::decode_reply);
        let reply = reply.ok_or_else(|| format!("{command}: the reply is {bytes:02x?}"))?;
        let answered = sent.first().map_or(asked, |character| character.start);
        Ok(Exchange { asked, answered, reply })
    }
}
