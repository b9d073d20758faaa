//! Additions to a module, of an image or of a tool: user functions, with what they can do, and a look at the commands
//! that a program executes.

use crate::executor::ports::OUTPUTS;
use crate::tmcl::{Command, Opcode, Status};
use crate::units::Micros;
use crate::vm::{Errors, Registers};

/// Additions to the module. Each method has an empty default, so `()` adds nothing.
pub trait Hooks {
    /// True where the commands of a program that need the interpreter alone are executed in bursts. A test that has it
    /// false sees how the same program runs command by command.
    const BURSTS: bool = true;

    /// Executes user function `number`, 0..=7: commands UF0..UF7, to which an image may give a meaning (manual
    /// section 3.7.36). Type, motor and value of the command mean what the function makes of them. `module` carries out
    /// what the function wants done; the value is returned in the reply.
    ///
    /// Axes and links wait meanwhile, so a function is to be over within some 100 us: a command that talks to a chip
    /// takes 25 to 75 us. What should take longer is done step by step, in one call after the other.
    ///
    /// # Errors
    /// The status to answer with; [`Status::NotAvailable`] unless overridden. What the function has had done before it
    /// refuses stays done.
    fn call(&mut self, number: u8, command: Command, module: &mut impl Execute) -> Result<i32, Status> {
        let _ = (number, command, module);
        Err(Status::NotAvailable)
    }

    /// Is told of each command that a program has executed, right after it: with accumulator, X register and flags as
    /// they are then.
    fn executed(&mut self, executed: &Executed, registers: &Registers, errors: Errors) {
        let _ = (executed, registers, errors);
    }
}

impl Hooks for () {}

/// A module as its user functions have it: it carries out commands of TMCL, with the same checks and the same effects
/// as if a host had sent them. The methods with names are short for single commands (manual sections 3.7.1 to 3.7.15),
/// and have the operands in their order.
pub trait Execute {
    /// Carries out a command, and returns what its reply would have as the value.
    ///
    /// A function may do what hosts and programs alike may do. It may not execute commands that are a program's alone
    /// (COMP, JC, JA, CSUB, RSUB, WAIT, STOP, RETI), control commands (from 128 on), and user functions. These are
    /// refused with status 6.
    ///
    /// The reply of a function that stores something comes when that would survive a power cut, and with status 5 if it
    /// would not. Of the coordinates that are stored at once (global parameter 84) it may set one, which can be taken
    /// back then. Behind it SCO, CCO and ACO are refused with status 6.
    ///
    /// # Errors
    /// The status with which the command is refused. Then it had no effect.
    fn execute(&mut self, command: Command) -> Result<i32, Status>;

    /// Accumulator, X register and flags. A program has them before and behind the function; commands that read leave
    /// them alone.
    fn registers(&mut self) -> &mut Registers;

    /// GAP: an axis parameter.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn axis_parameter(&mut self, number: u8, axis: u8) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Gap as u8, number, axis, 0))
    }

    /// SAP: sets an axis parameter.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn set_axis_parameter(&mut self, number: u8, axis: u8, value: i32) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Sap as u8, number, axis, value))
    }

    /// GGP: a global parameter, in bank 0 those of the module.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn global_parameter(&mut self, number: u8, bank: u8) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Ggp as u8, number, bank, 0))
    }

    /// SGP: sets a global parameter.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn set_global_parameter(&mut self, number: u8, bank: u8, value: i32) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Sgp as u8, number, bank, value))
    }

    /// A user variable, which is a global parameter of bank 2.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn variable(&mut self, number: u8) -> Result<i32, Status> {
        self.global_parameter(number, VARIABLES)
    }

    /// Sets a user variable.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn set_variable(&mut self, number: u8, value: i32) -> Result<i32, Status> {
        self.set_global_parameter(number, VARIABLES, value)
    }

    /// GIO: an input, or how an output is set; [`ports`](super::ports) has the banks.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn input(&mut self, port: u8, bank: u8) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Gio as u8, port, bank, 0))
    }

    /// SIO: sets a digital output.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn set_output(&mut self, port: u8, on: bool) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Sio as u8, port, OUTPUTS, on.into()))
    }

    /// ROR: turns an axis, to the left with a negative speed.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn rotate(&mut self, axis: u8, speed: i32) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Ror as u8, 0, axis, speed))
    }

    /// MST: stops an axis.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn stop(&mut self, axis: u8) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Mst as u8, 0, axis, 0))
    }

    /// MVP ABS: moves an axis to a position, in microsteps.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn move_to(&mut self, axis: u8, position: i32) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Mvp as u8, ABSOLUTE, axis, position))
    }

    /// MVP REL: moves an axis by a distance, in microsteps; returns its target.
    ///
    /// # Errors
    /// As [`Execute::execute`].
    fn move_by(&mut self, axis: u8, distance: i32) -> Result<i32, Status> {
        self.execute(Command::new(Opcode::Mvp as u8, RELATIVE, axis, distance))
    }
}

/// The bank of the user variables.
const VARIABLES: u8 = 2;
/// The types of MVP.
const ABSOLUTE: u8 = 0;
const RELATIVE: u8 = 1;

/// A command that a program has executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executed {
    /// The time at which it was executed.
    pub at: Micros,
    /// Address of the command in program memory, in commands.
    pub address: u16,
    /// The command.
    pub command: Command,
    /// True if it belongs to the handler of an interrupt.
    pub handler: bool,
    /// The status with which it was refused; `None` if it had its effect.
    pub refused: Option<Status>,
}
