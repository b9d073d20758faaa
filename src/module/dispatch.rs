//! From a command to what it does: one exhaustive match over the instruction table.

use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;

use super::axes::ALL_AXES;
use super::{Done, Module, RESTART_DELAY, Source, UserFunctions};
use crate::tmcl::{Command, Motor, Opcode, Reply, Status};
use crate::units::Micros;
use crate::vm::Operation;

/// The value that commands 137 and 255 want as a safeguard.
const CONFIRMATION: i32 = 1234;

impl<M: SpiDevice, D: SpiDevice, E: OutputPin, U: UserFunctions, const AXES: usize> Module<M, D, E, U, AXES> {
    /// Executes a command that came over a link. Checked in this order: the number, whether it may run
    /// here, the motor, and what the command itself wants.
    pub(super) fn dispatch(&mut self, now: Micros, source: Source, command: Command) -> Result<Done, Status> {
        let opcode = Opcode::from_number(command.opcode).ok_or(Status::InvalidCommand)?;
        let instruction = opcode.instruction();
        if !instruction.direct {
            return Err(Status::NotAvailable);
        }
        let Command { kind, motor, value, .. } = command;
        let known = usize::from(motor) < AXES;
        match instruction.motor {
            Motor::Axis if !known => return Err(Status::InvalidValue),
            Motor::AxisOrAll if !known && motor != ALL_AXES => return Err(Status::InvalidValue),
            Motor::Axis | Motor::AxisOrAll | Motor::Other => {}
        }
        match opcode {
            Opcode::Ror => self.rotate(now, motor, value)?,
            Opcode::Rol => self.rotate(now, motor, value.checked_neg().ok_or(Status::InvalidValue)?)?,
            Opcode::Mst => self.rotate(now, motor, 0)?,
            Opcode::Mvp => return self.move_position(now, command),
            Opcode::Sap => return self.set_axis(now, kind, motor, value, value),
            Opcode::Gap => return self.get_axis(kind, motor),
            Opcode::Stap => return self.store_axis(kind, motor, value),
            Opcode::Rsap => return self.restore_axis(now, kind, motor, value),
            Opcode::Sgp => return self.set_global(now, kind, motor, value, value),
            Opcode::Ggp => return self.get_global(now, kind, motor),
            Opcode::Stgp => return self.store_global(kind, motor, value),
            Opcode::Rsgp => return self.restore_global(kind, motor, value),
            Opcode::Rfs => return self.reference_search(now, kind, motor, value),
            Opcode::Sio => return self.set_output(kind, motor, value),
            Opcode::Gio => return self.get_input(kind, motor),
            Opcode::Sco if motor == ALL_AXES => return self.store_coordinates(kind, value),
            Opcode::Sco => return self.set_coordinate(kind, motor, value, value),
            Opcode::Gco if motor == ALL_AXES => return self.restore_coordinates(kind, value),
            Opcode::Gco => return self.coordinate(motor, kind).map(Done::Value),
            Opcode::Cco => {
                let position = self.position(motor)?;
                return self.set_coordinate(kind, motor, position, position);
            }
            Opcode::Aco => return self.set_coordinate(kind, motor, self.registers.accumulator, value),
            Opcode::Aap => return self.set_axis(now, kind, motor, self.registers.accumulator, value),
            Opcode::Agp => return self.set_global(now, kind, motor, self.registers.accumulator, value),
            Opcode::Calc => {
                let operation = Operation::from_number(kind).ok_or(Status::WrongType)?;
                if !self.registers.calc(operation, value) {
                    return Err(Status::WrongType);
                }
            }
            Opcode::Calcx => self.registers.calcx(Operation::from_number(kind).ok_or(Status::WrongType)?),
            Opcode::Cle => {
                if !self.registers.clear(kind) {
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
                return self.user.call(number, command).map(Done::Value);
            }
            Opcode::FirmwareVersion => {
                return match kind {
                    0 => Ok(Done::Special(Reply::Version(self.spec.version_string()))),
                    1 => Ok(Done::Value(self.spec.version_number())),
                    _ => Err(Status::WrongType),
                };
            }
            Opcode::PositionReachedEvent => return self.subscribe(source, command),
            Opcode::FactorySettings => {
                confirmed(value)?;
                self.store.reset();
                self.restart = Some(now);
                return Ok(Done::Silent);
            }
            Opcode::SoftwareReset => {
                confirmed(value)?;
                self.restart = Some(now.after(RESTART_DELAY));
            }
            // The link changes its mode; CAN has but one.
            Opcode::EnterAscii if !matches!(source, Source::Can { .. }) => {}
            // Programs and the bootloader are not there yet.
            Opcode::Ei
            | Opcode::Di
            | Opcode::Vect
            | Opcode::StopApplication
            | Opcode::RunApplication
            | Opcode::StepApplication
            | Opcode::ResetApplication
            | Opcode::EnterDownload
            | Opcode::ExitDownload
            | Opcode::ReadMemory
            | Opcode::ApplicationStatus
            | Opcode::EnterAscii
            | Opcode::EnterBootloader => return Err(Status::NotAvailable),
            Opcode::Comp
            | Opcode::Jc
            | Opcode::Ja
            | Opcode::Csub
            | Opcode::Rsub
            | Opcode::Wait
            | Opcode::Stop
            | Opcode::Reti => return Err(Status::NotAvailable),
        }
        Ok(Done::Value(value))
    }
}

fn confirmed(value: i32) -> Result<(), Status> {
    if value == CONFIRMATION { Ok(()) } else { Err(Status::InvalidValue) }
}
