//! From a command of a link or of a program to those who carry it out, and to its answer. Most commands are the
//! executor's; those of programs, downloads, events and restarts are the module's own.

use core::task::Poll;

use super::control::Control;
use super::perform::Performer;
use super::waiting::{Waiter, WaitingCommand};
use super::{Answer, Module, Origin, Platform, Product, Source, factory_reset};
use crate::executor::{Commands, Outcome, SETTINGS, admit, confirm};
use crate::tmcl::{Command, Opcode, Reply, Status};
use crate::units::Micros;

/// The time between the reply to a software reset and the reset, in which the reply is sent: at 9600 bit/s in 9.4 ms,
/// after a moderate telegram pause.
const RESTART_DELAY: Micros = Micros::from_millis(100);

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// [`Module::execute`] while no restart is due. What hosts ask most often, GAP and GGP, and what is refused goes a
    /// short way here; all else is executed by [`Module::carry_out`].
    pub(super) fn obey(&mut self, now: Micros, origin: Origin, command: Command) -> Answer {
        self.links.hear(now, origin.source);
        let Command { opcode, kind, motor, .. } = command;
        let read = match self.admit(origin.source, command) {
            Ok(Some(Opcode::Gap)) => self.readings(now).get_axis(kind, motor),
            Ok(Some(Opcode::Ggp)) => match self.executor.globals.setting::<T::Product>(kind) {
                Some(setting) if motor == SETTINGS => Ok(setting),
                _ => self.readings(now).get_global(kind, motor),
            },
            Ok(admitted) => return self.carry_out(now, origin, admitted, command),
            Err(status) => Err(status),
        };
        let reply = match read {
            Ok(value) => Reply::Plain { status: Status::Ok, opcode, value },
            Err(status) => Reply::echo(status, command),
        };
        if self.executor.globals.suppress(opcode) { Poll::Ready(None) } else { Poll::Ready(Some(reply)) }
    }

    /// Carries out a command of a link: one that was admitted, or one of a download. Never inlined: reading a parameter
    /// is not to have its stack frame.
    #[inline(never)]
    fn carry_out(&mut self, now: Micros, origin: Origin, admitted: Option<Opcode>, command: Command) -> Answer {
        let suppressed = self.executor.globals.suppress(command.opcode);
        let outcome = match admitted {
            Some(opcode) if command.opcode < Command::FIRST_CONTROL => self.perform(now, opcode, command),
            Some(opcode) => self.act(now, origin, opcode, command),
            None => self.control().download(command),
        };
        let reply = match outcome {
            Ok(Outcome::Stored { value, need, undo }) if !self.device.store().settled(need) => {
                let waiting = WaitingCommand { from: Waiter::Link(origin), command, need, value, undo, suppressed };
                // There is no room only if a host sends on without waiting for its replies.
                let refused = Reply::echo(Status::NotAvailable, command);
                return if self.waiting.push(waiting) { Poll::Pending } else { Poll::Ready(Some(refused)) };
            }
            Ok(outcome) => outcome.reply(command),
            Err(status) => Some(Reply::echo(status, command)),
        };
        Poll::Ready(if suppressed { None } else { reply })
    }

    /// Admits a command of a link: `None` is one to be stored in program memory by a [download](Control::download).
    pub(super) fn admit(&self, source: Source, command: Command) -> Result<Option<Opcode>, Status> {
        if command.opcode < Command::FIRST_CONTROL && self.program.downloads_here(self.device.store(), source) {
            return Ok(None);
        }
        admit::<T::Product, AXES>(command).map(Some)
    }

    /// Carries out a command of a link or of the program, whose number and motor field are checked: a user function, or
    /// what the executor does.
    pub(super) fn perform(&mut self, now: Micros, opcode: Opcode, command: Command) -> Result<Outcome, Status> {
        let Module { machine, device, executor, links, arrivals, hooks, .. } = self;
        let mut performer = Performer { now, machine, device, executor, links, arrivals };
        match opcode.user_function() {
            Some(number) => performer.call(hooks, number, command),
            None => performer.perform(opcode, command),
        }
    }

    /// Carries out a control command of a link. Programs have none.
    fn act(&mut self, now: Micros, origin: Origin, opcode: Opcode, command: Command) -> Result<Outcome, Status> {
        let Command { kind, value, .. } = command;
        match opcode {
            Opcode::StopApplication => self.machine.stop(),
            Opcode::RunApplication => self.control().run(kind, value)?,
            Opcode::StepApplication => self.control().step()?,
            Opcode::ResetApplication => self.machine.reset(),
            Opcode::EnterDownload => return self.control().enter_download(origin.source, value),
            Opcode::ExitDownload => return self.control().exit_download(origin.source, value),
            Opcode::ReadMemory => return self.control().read_memory(value),
            Opcode::ApplicationStatus => return self.control().status(kind).map(Outcome::Value),
            Opcode::PositionReachedEvent => return self.arrivals.subscribe::<AXES>(origin, command),
            Opcode::FirmwareVersion => return T::Product::SPEC.version(kind),
            Opcode::FactorySettings => {
                confirm(value)?;
                factory_reset(self.device.store_mut());
                self.restart(now);
                return Ok(Outcome::Unanswered);
            }
            Opcode::SoftwareReset => {
                confirm(value)?;
                self.restart(now.after(RESTART_DELAY));
            }
            // This firmware has no boot loader. The command is not answered, because update tools would take the next
            // reply that they receive for that to a later request.
            Opcode::EnterBootloader if command == Command::ENTER_BOOTLOADER => return Ok(Outcome::Unanswered),
            Opcode::EnterBootloader => return Err(Status::InvalidValue),
            // The link itself changes its mode. CAN has only one mode.
            Opcode::EnterAscii if origin.source != Source::Can => {}
            Opcode::EnterAscii => return Err(Status::NotAvailable),
            // These are no control commands.
            Opcode::Ror
            | Opcode::Rol
            | Opcode::Mst
            | Opcode::Mvp
            | Opcode::Rfs
            | Opcode::Sap
            | Opcode::Gap
            | Opcode::Aap
            | Opcode::Stap
            | Opcode::Rsap
            | Opcode::Sgp
            | Opcode::Ggp
            | Opcode::Agp
            | Opcode::Stgp
            | Opcode::Rsgp
            | Opcode::Sio
            | Opcode::Gio
            | Opcode::Sco
            | Opcode::Gco
            | Opcode::Cco
            | Opcode::Aco
            | Opcode::Calc
            | Opcode::Calcx
            | Opcode::Cle
            | Opcode::Ei
            | Opcode::Di
            | Opcode::Vect
            | Opcode::Uf0
            | Opcode::Uf1
            | Opcode::Uf2
            | Opcode::Uf3
            | Opcode::Uf4
            | Opcode::Uf5
            | Opcode::Uf6
            | Opcode::Uf7
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

    /// The commands of the executor that only read.
    #[inline(always)]
    pub(super) fn readings(&mut self, now: Micros) -> Commands<'_, T, AXES> {
        let Module { machine, device, executor, .. } = self;
        executor.on(now, true, machine, device)
    }

    /// The commands that control the program.
    pub(super) const fn control(&mut self) -> Control<'_, T, AXES> {
        let Module { machine, program, device, executor, .. } = self;
        Control { program, machine, device, globals: &executor.globals }
    }

    /// Restarts the firmware at `at`. From now on requests are neither executed nor answered and the program stands, so
    /// that nothing new delays the restart.
    fn restart(&mut self, at: Micros) {
        self.machine.stop();
        self.device.restart_at(at);
    }
}
