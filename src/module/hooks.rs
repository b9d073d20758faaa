//! What an image, or a tool, adds to the module.

use crate::tmcl::{Command, Status};
use crate::units::Micros;
use crate::vm::Machine;

/// Additions to the module. Each has an empty one to begin with.
pub trait Hooks {
    /// Executes user function `number`, 0..=7: commands UF0..UF7, to which an image may give a meaning (manual
    /// section 3.7.36). The value is returned in the reply.
    ///
    /// # Errors
    /// The status to answer with; [`Status::NotAvailable`] unless overridden.
    fn call(&mut self, number: u8, command: Command) -> Result<i32, Status> {
        let _ = (number, command);
        Err(Status::NotAvailable)
    }

    /// Looks at a command that a program has just executed.
    fn executed(&mut self, executed: &Executed, machine: &Machine) {
        let _ = (executed, machine);
    }
}

impl Hooks for () {}

/// A command of a program, executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executed {
    /// When.
    pub at: Micros,
    /// Its address.
    pub address: u16,
    /// The command.
    pub command: Command,
    /// It belongs to the handler of an interrupt.
    pub handler: bool,
    /// Why it had no effect, if it had none.
    pub refused: Option<Status>,
}
