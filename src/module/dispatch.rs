//! From a command to what it does: one exhaustive match over the instruction table. Links and programs share it.

use super::outcome::Outcome;
use super::{Hooks, Module, Origin, Platform, RESTART_DELAY, Source, Spec, factory_reset};
use crate::param::{ALL_INTERRUPTS, Interrupt};
use crate::tmcl::{ALL_AXES, AxisSet, CONFIRMATION, Command, Instruction, MotorField, Opcode, Reply, Status};
use crate::units::Micros;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Admits a command of a link: `None` is one to be stored in program memory by a [download](Self::download). Checked
    /// in this order are the number, whether the command may be executed outside a program, the motor field, and, by
    /// [`Module::act`], what the command itself demands.
    pub(super) fn admit(&self, source: Source, command: Command) -> Result<Option<Opcode>, Status> {
        if command.opcode < Command::FIRST_CONTROL && self.downloads_here(source) {
            return Ok(None);
        }
        let instruction = Instruction::numbered(command.opcode).ok_or(Status::InvalidCommand)?;
        if !instruction.direct {
            return Err(Status::NotAvailable);
        }
        self.check_motor(instruction, command.motor).map(|()| Some(instruction.opcode))
    }

    /// Executes a command of the program.
    pub(super) fn perform(
        &mut self,
        now: Micros,
        instruction: &Instruction,
        command: Command,
    ) -> Result<Outcome, Status> {
        self.check_motor(instruction, command.motor)?;
        self.act(now, None, instruction.opcode, command)
    }

    /// Whether the product has the command, and the motor that its motor field names. Inlined, because every reply waits for
    /// it: a call takes 27 cycles.
    #[inline(always)]
    fn check_motor(&self, instruction: &Instruction, motor: u8) -> Result<(), Status> {
        let known = usize::from(motor) < AXES;
        if self.spec().lacks.contains(&instruction.opcode) {
            return Err(Status::InvalidCommand);
        }
        match instruction.motor {
            MotorField::Axis if !known => Err(Status::InvalidValue),
            MotorField::AxisOrAll if !known && motor != ALL_AXES => Err(Status::InvalidValue),
            MotorField::AxisSet if !known && AxisSet::of(motor, AXES as u8).is_none() => Err(Status::InvalidValue),
            MotorField::Axis | MotorField::AxisOrAll | MotorField::AxisSet | MotorField::Other => Ok(()),
        }
    }

    /// Executes a command of a link, or of the program if `origin` is `None`, whose number and motor field are checked.
    pub(super) fn act(
        &mut self,
        now: Micros,
        origin: Option<Origin>,
        opcode: Opcode,
        command: Command,
    ) -> Result<Outcome, Status> {
        let Command { kind, motor, value, .. } = command;
        match opcode {
            Opcode::Ror => self.rotate(now, motor, value)?,
            Opcode::Rol => self.rotate(now, motor, value.saturating_neg())?,
            Opcode::Mst => self.rotate(now, motor, 0)?,
            Opcode::Mvp => return self.move_position(now, command),
            Opcode::Sap => return self.set_axis(now, kind, motor, value, value),
            Opcode::Gap => return self.get_axis(kind, motor).map(Outcome::Read),
            Opcode::Stap => return self.store_axis(kind, motor, value),
            Opcode::Rsap => return self.restore_axis(now, kind, motor, value),
            Opcode::Sgp => return self.set_global(now, kind, motor, value, value),
            Opcode::Ggp => return self.get_global(now, kind, motor).map(Outcome::Read),
            Opcode::Stgp => return self.store_global(kind, motor, value),
            Opcode::Rsgp => return self.restore_global(kind, motor, value),
            Opcode::Rfs => return self.reference_search(now, kind, motor, value),
            Opcode::Sio => return self.set_output(kind, motor, value),
            Opcode::Gio => return self.get_input(kind, motor),
            Opcode::Sco if motor == ALL_AXES => return self.store_coordinates(kind, value),
            Opcode::Sco => return self.set_coordinate(kind, motor, value, value),
            Opcode::Gco if motor == ALL_AXES => return self.restore_coordinates(kind, value),
            Opcode::Gco => return self.coordinate(motor, kind).map(Outcome::Read),
            Opcode::Cco => {
                let position = self.position(motor)?;
                return self.set_coordinate(kind, motor, position, position);
            }
            Opcode::Aco => return self.set_coordinate(kind, motor, self.machine.registers.accumulator, value),
            Opcode::Aap => return self.set_axis(now, kind, motor, self.machine.registers.accumulator, value),
            Opcode::Agp => return self.set_global(now, kind, motor, self.machine.registers.accumulator, value),
            Opcode::Calc => self.machine.registers.calc(kind, value)?,
            Opcode::Calcx => self.machine.registers.calcx(kind)?,
            Opcode::Cle => {
                if !self.machine.errors.clear(kind) {
                    return Err(Status::WrongType);
                }
            }
            Opcode::Uf0
            | Opcode::Uf1
            | Opcode::Uf2
            | Opcode::Uf3
            | Opcode::Uf4
            | Opcode::Uf5
            | Opcode::Uf6
            | Opcode::Uf7 => {
                let number = command.opcode.saturating_sub(Opcode::Uf0 as u8);
                return self.hooks.call(number, command).map(Outcome::Value);
            }
            Opcode::FirmwareVersion => {
                return match kind {
                    0 => Ok(Outcome::Special(Reply::Version(self.spec().version_string()))),
                    1 => Ok(Outcome::Value(self.spec().version_number())),
                    _ => Err(Status::WrongType),
                };
            }
            Opcode::PositionReachedEvent => return self.subscribe(origin.ok_or(Status::NotAvailable)?, command),
            Opcode::FactorySettings => {
                confirmed(value)?;
                self.may_store()?;
                factory_reset(self.device.store_mut());
                self.restart(now);
                return Ok(Outcome::Unanswered);
            }
            Opcode::SoftwareReset => {
                confirmed(value)?;
                self.restart(now.after(RESTART_DELAY));
            }
            // This firmware has no boot loader. The command is not answered, because update tools would take the next
            // reply that they receive for that to a later request.
            Opcode::EnterBootloader if command == Command::ENTER_BOOTLOADER => return Ok(Outcome::Unanswered),
            Opcode::EnterBootloader => return Err(Status::InvalidValue),
            // The link itself changes its mode. CAN has only one mode.
            Opcode::EnterAscii if origin.is_none_or(|origin| origin.source != Source::Can) => {}
            Opcode::Ei | Opcode::Di => {
                self.check_interrupt(kind, true)?;
                self.machine.interrupts.enable(kind, opcode == Opcode::Ei);
            }
            Opcode::Vect => {
                self.check_interrupt(kind, false)?;
                self.machine.interrupts.set_vector(kind, self.address(value)?);
            }
            Opcode::StopApplication => self.machine.stop(),
            Opcode::RunApplication => self.run_application(kind, value)?,
            Opcode::StepApplication => self.step_application()?,
            Opcode::ResetApplication => self.machine.reset(),
            Opcode::EnterDownload => return self.enter_download(origin.ok_or(Status::NotAvailable)?.source, value),
            Opcode::ExitDownload => {
                return self.exit_download(origin.ok_or(Status::NotAvailable)?.source, value);
            }
            Opcode::ReadMemory => return self.read_memory(value),
            Opcode::ApplicationStatus => return self.application_status(kind),
            // Except `EnterAscii`, these commands are executed by the interpreter alone.
            Opcode::EnterAscii
            | Opcode::Comp
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

    /// Checks the number of an interrupt; with `all` the number that stands for all interrupts is valid, too.
    fn check_interrupt(&self, number: u8, all: bool) -> Result<(), Status> {
        let Spec { axes, inputs, .. } = *self.spec();
        let known = (all && number == ALL_INTERRUPTS) || Interrupt::find(number, axes, inputs).is_some();
        if known { Ok(()) } else { Err(Status::WrongType) }
    }
}

/// Checks the value 1234, which protects commands 137 and 255.
fn confirmed(value: i32) -> Result<(), Status> {
    if value == CONFIRMATION { Ok(()) } else { Err(Status::InvalidValue) }
}
