//! The executor at work for a module: whoever is concerned by what a command has done is told. User functions have
//! their commands carried out in the same way.

use super::arrival::Arrivals;
use super::hooks::{Execute, Hooks};
use super::links::Links;
use super::spec::Product;
use crate::device::{Circuit, Device};
use crate::executor::{Executor, Outcome, Undo, admit};
use crate::store::Need;
use crate::tmcl::{Command, Opcode, Status};
use crate::units::Micros;
use crate::vm::{Machine, Registers};

/// All of a module that a command of the executor concerns. It does not have the hooks: so a user function, which is
/// given this, cannot call another one, and the stack has one of them at a time.
pub(super) struct Performer<'a, T: Circuit, const AXES: usize> {
    pub(super) now: Micros,
    pub(super) machine: &'a mut Machine,
    pub(super) device: &'a mut Device<T, AXES>,
    pub(super) executor: &'a mut Executor<AXES>,
    pub(super) links: &'a mut Links,
    pub(super) arrivals: &'a mut Arrivals,
}

impl<T: Circuit<Product: Product>, const AXES: usize> Performer<'_, T, AXES> {
    /// Has the executor carry out a command whose number and motor field are checked, and tells the links and the host
    /// of command 138 what concerns them. While a host is silent that should be heard, no motor is started.
    pub(super) fn perform(&mut self, opcode: Opcode, command: Command) -> Result<Outcome, Status> {
        let Performer { now, machine, device, executor, links, arrivals } = self;
        let barred = links.heartbeat_missed(*now, &executor.globals);
        let outcome = executor.on(*now, barred, machine, device).act(opcode, command);
        if matches!(opcode, Opcode::Sgp | Opcode::Agp) && outcome.is_ok() {
            links.follow::<T::Product>(*now, command.kind, command.motor);
        }
        if let Ok(Outcome::Moved { ended, begun, .. }) = outcome {
            arrivals.disarm(ended);
            arrivals.arm(begun);
        }
        outcome
    }

    /// Calls a user function.
    pub(super) fn call(self, hooks: &mut impl Hooks, number: u8, command: Command) -> Result<Outcome, Status> {
        let mut caller = Caller { performer: self, stored: None, undo: None };
        let value = hooks.call(number, command, &mut caller)?;
        let Caller { stored, undo, .. } = caller;
        Ok(stored.map_or(Outcome::Value(value), |need| Outcome::Stored { value, need, undo }))
    }
}

/// The part of its module that a user function has, and what it has had stored.
struct Caller<'a, T: Circuit, const AXES: usize> {
    performer: Performer<'a, T, AXES>,
    /// The part of the EEPROM that has to be up to date before the reply.
    stored: Option<Need>,
    /// The change to take back if writing the EEPROM fails.
    undo: Option<Undo>,
}

impl<T: Circuit<Product: Product>, const AXES: usize> Execute for Caller<'_, T, AXES> {
    fn execute(&mut self, command: Command) -> Result<i32, Status> {
        let opcode = admit::<T::Product, AXES>(command)?;
        if self.undo.is_some() && matches!(opcode, Opcode::Sco | Opcode::Cco | Opcode::Aco) {
            return Err(Status::NotAvailable);
        }
        match self.performer.perform(opcode, command)? {
            Outcome::Value(value) | Outcome::Moved { value, .. } | Outcome::Read(value) => Ok(value),
            Outcome::Stored { value, need, undo } => {
                // What the program needs has the settings in it.
                self.stored = self.stored.filter(|before| *before == Need::Program).or(Some(need));
                self.undo = self.undo.or(undo);
                Ok(value)
            }
            // Replies of these kinds are those of control commands, which the executor refuses.
            Outcome::Special(_) | Outcome::Unanswered => Err(Status::NotAvailable),
        }
    }

    fn registers(&mut self) -> &mut Registers {
        &mut self.performer.machine.registers
    }
}
