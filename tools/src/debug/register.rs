//! The registers of the program: read by command 135, set by the commands of programs, which modules also execute
//! directly.

use tmcm::tmcl::{Command, Opcode};

use super::state::State;
use super::trouble::Trouble;
use crate::conversation::{Conversation, Error};

/// Types of command 135.
mod kind {
    pub(super) const PROGRAM_COUNTER: u8 = 1;
    pub(super) const ACCUMULATOR: u8 = 2;
    pub(super) const X_REGISTER: u8 = 3;
}

/// CALC LOAD: a number to the accumulator (manual section 3.7.16).
const LOAD: Command = Command::new(Opcode::Calc as u8, 9, 0, 0);
/// CALCX SWAP: exchanges accumulator and X register (manual section 3.7.28).
const SWAP: Command = Command::new(Opcode::Calcx as u8, 10, 0, 0);

/// A register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// The accumulator.
    Accumulator,
    /// The X register.
    X,
    /// The program counter.
    Counter,
}

impl Register {
    /// The names of the registers.
    pub const NAMES: [&str; 3] = ["acc", "x", "pc"];

    /// The register with this name. Upper and lower case are the same.
    pub fn named(word: &str) -> Option<Self> {
        match word.to_ascii_lowercase().as_str() {
            "acc" | "accumulator" => Some(Register::Accumulator),
            "x" => Some(Register::X),
            "pc" => Some(Register::Counter),
            _ => None,
        }
    }

    /// Reads the value of the register.
    pub fn read(self, module: &mut Conversation) -> Result<i32, Error> {
        match self {
            Register::Accumulator => module.control(Opcode::ApplicationStatus, kind::ACCUMULATOR, 0),
            Register::X => module.control(Opcode::ApplicationStatus, kind::X_REGISTER, 0),
            Register::Counter => Ok(state(module)?.counter.into()),
        }
    }

    /// Changes the value of the register, of a program that is halted. No command sets a register but those of
    /// programs, so these are sent. Command 135 is the only one that tells what they have done, so the value is read
    /// back.
    pub fn write(self, module: &mut Conversation, value: i32) -> Result<(), Trouble> {
        let load = Command { value, ..LOAD };
        let commands: &[Command] = match self {
            Register::Accumulator => &[load],
            Register::X => &[SWAP, load, SWAP],
            Register::Counter => {
                let message = "no command sets the program counter alone; 'send 129, 1, 0, PLACE' runs from a place on";
                return Err(Trouble::Mistake(message.into()));
            }
        };
        for command in commands {
            module.request(*command)?;
        }
        match self.read(module)? {
            now if now == value => Ok(()),
            now => Err(Trouble::Mistake(format!("the module does not take it: it has {now}"))),
        }
    }
}

/// The state of the program.
pub(super) fn state(module: &mut Conversation) -> Result<State, Error> {
    module.control(Opcode::ApplicationStatus, kind::PROGRAM_COUNTER, 0).map(State::of)
}
