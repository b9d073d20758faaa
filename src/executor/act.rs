//! From a command to what it does: one exhaustive match over the instruction table, in which those commands are refused
//! that are for the executor's owner.

use super::{Commands, Outcome, Product, Spec};
use crate::device::Circuit;
use crate::param::{ALL_INTERRUPTS, AxisParameter, Interrupt};
use crate::tmcl::{ALL_AXES, Command, Opcode, SEARCH_STATUS, Status};

impl<T: Circuit<Product: Product>, const AXES: usize> Commands<'_, T, AXES> {
    /// Returns what a command that only reads would read. Whether a position is reached is told by the last reading, so
    /// that no chip is asked for it.
    pub(crate) fn peek(&mut self, opcode: Opcode, command: Command) -> Result<i32, Status> {
        let Command { kind, motor, .. } = command;
        let outcome = match opcode {
            Opcode::Gap if reads::<T::Product>(kind, AxisParameter::PositionReached) => {
                return Ok(self.axis(motor)?.state().at_target().into());
            }
            Opcode::Gap => return self.get_axis(kind, motor),
            Opcode::Ggp => return self.get_global(kind, motor),
            Opcode::Gio => self.get_input(kind, motor)?,
            Opcode::Rfs if kind == SEARCH_STATUS => self.reference_search(kind, motor, 0)?,
            _ => return Err(Status::NotAvailable),
        };
        match outcome {
            Outcome::Read(value) => Ok(value),
            _ => Err(Status::NotAvailable),
        }
    }

    /// Executes a command whose number and motor field are checked. Control commands are those from
    /// [`Command::FIRST_CONTROL`] on, as those of programs, downloads, events and restarts. They and user functions are
    /// for the owner of the executor: here they are refused with status 6. Inlined into the one function by which an
    /// owner has commands carried out, so that no outcome is handed on once more.
    #[inline(always)]
    pub(crate) fn act(&mut self, opcode: Opcode, command: Command) -> Result<Outcome, Status> {
        let Command { kind, motor, value, .. } = command;
        match opcode {
            Opcode::Ror => return self.rotate(motor, value, value),
            Opcode::Rol => return self.rotate(motor, value.saturating_neg(), value),
            Opcode::Mst => return self.rotate(motor, 0, value),
            Opcode::Mvp => return self.move_position(kind, motor, value),
            Opcode::Sap => return self.set_axis(kind, motor, value, value),
            Opcode::Gap => return self.get_axis(kind, motor).map(Outcome::Read),
            Opcode::Stap => return self.store_axis(kind, motor, value),
            Opcode::Rsap => return self.restore_axis(kind, motor, value),
            Opcode::Sgp => return self.set_global(kind, motor, value, value),
            Opcode::Ggp => return self.get_global(kind, motor).map(Outcome::Read),
            Opcode::Stgp => return self.store_global(kind, motor, value),
            Opcode::Rsgp => return self.restore_global(kind, motor, value),
            Opcode::Rfs => return self.reference_search(kind, motor, value),
            Opcode::Sio => return self.set_output(kind, motor, value),
            Opcode::Gio => return self.get_input(kind, motor),
            Opcode::Sco if motor == ALL_AXES => return self.store_coordinates(kind, value),
            Opcode::Sco => return self.set_coordinate(kind, motor, value, value),
            Opcode::Gco if motor == ALL_AXES => return self.restore_coordinates(kind, value),
            Opcode::Gco => return self.executor.coordinates.get(motor, kind).map(Outcome::Read),
            Opcode::Cco => {
                let position = self.position(motor)?;
                return self.set_coordinate(kind, motor, position, position);
            }
            Opcode::Aco => return self.set_coordinate(kind, motor, self.machine.registers.accumulator, value),
            Opcode::Aap => return self.set_axis(kind, motor, self.machine.registers.accumulator, value),
            Opcode::Agp => return self.set_global(kind, motor, self.machine.registers.accumulator, value),
            Opcode::Calc => self.machine.registers.calc(kind, value)?,
            Opcode::Calcx => self.machine.registers.calcx(kind)?,
            Opcode::Cle => {
                if !self.machine.errors.clear(kind) {
                    return Err(Status::WrongType);
                }
            }
            Opcode::Ei | Opcode::Di => {
                check_interrupt(Self::SPEC, kind, true)?;
                self.machine.interrupts.enable(kind, opcode == Opcode::Ei);
            }
            Opcode::Vect => {
                check_interrupt(Self::SPEC, kind, false)?;
                self.machine.interrupts.set_vector(kind, Self::SPEC.address(value)?);
            }
            // Control commands.
            Opcode::StopApplication
            | Opcode::RunApplication
            | Opcode::StepApplication
            | Opcode::ResetApplication
            | Opcode::EnterDownload
            | Opcode::ExitDownload
            | Opcode::ReadMemory
            | Opcode::ApplicationStatus
            | Opcode::FirmwareVersion
            | Opcode::FactorySettings
            | Opcode::PositionReachedEvent
            | Opcode::EnterAscii
            | Opcode::EnterBootloader
            | Opcode::SoftwareReset => return Err(Status::NotAvailable),
            // User functions.
            Opcode::Uf0
            | Opcode::Uf1
            | Opcode::Uf2
            | Opcode::Uf3
            | Opcode::Uf4
            | Opcode::Uf5
            | Opcode::Uf6
            | Opcode::Uf7 => return Err(Status::NotAvailable),
            // These are executed by the interpreter alone.
            Opcode::Comp
            | Opcode::Jc
            | Opcode::Ja
            | Opcode::Csub
            | Opcode::Rsub
            | Opcode::Wait
            | Opcode::Stop
            | Opcode::Reti => return Err(Status::NotAvailable),
        }
        Ok(Outcome::Value(value))
    }
}

/// Checks the number of an interrupt; with `all` the number that stands for all interrupts is valid, too.
fn check_interrupt(spec: &Spec, number: u8, all: bool) -> Result<(), Status> {
    let Spec { axes, inputs, .. } = *spec;
    let known = (all && number == ALL_INTERRUPTS) || Interrupt::find(number, axes, inputs).is_some();
    if known { Ok(()) } else { Err(Status::WrongType) }
}

/// Whether a number is that of an axis parameter.
fn reads<P: Product>(number: u8, function: AxisParameter) -> bool {
    P::SPEC.axis.find(number).is_some_and(|parameter| parameter.function == function)
}
