//! Additions to a module, of an image or of a tool: user functions, and a look at the commands that a program executes.

use crate::tmcl::{Command, Status};
use crate::units::Micros;
use crate::vm::{Errors, Registers};

/// Additions to the module. Each method has an empty default, so `()` adds nothing.
pub trait Hooks {
    /// True where the commands of a program that need the interpreter alone are executed in bursts. A test that has it
    /// false sees how the same program runs command by command.
    const BURSTS: bool = true;

    /// Executes user function `number`, 0..=7: commands UF0..UF7, to which an image may give a meaning (manual
    /// section 3.7.36). The value is returned in the reply.
    ///
    /// # Errors
    /// The status to answer with; [`Status::NotAvailable`] unless overridden.
    fn call(&mut self, number: u8, command: Command) -> Result<i32, Status> {
        let _ = (number, command);
        Err(Status::NotAvailable)
    }

    /// Is told of each command that a program has executed, right after it: with accumulator, X register and flags as
    /// they are then.
    fn executed(&mut self, executed: &Executed, registers: &Registers, errors: Errors) {
        let _ = (executed, registers, errors);
    }
}

impl Hooks for () {}

/// A command that a program has executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executed {
    /// The time at which it was executed.
    pub at: Micros,
    /// Its address in program memory, in commands.
    pub address: u16,
    /// The command.
    pub command: Command,
    /// True if it belongs to the handler of an interrupt.
    pub handler: bool,
    /// The status with which it was refused; `None` if it had its effect.
    pub refused: Option<Status>,
}
