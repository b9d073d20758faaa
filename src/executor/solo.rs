//! An executor for an owner who knows nothing of TMCL: a CANopen node in TMCL mode. Commands come one by one, as bytes,
//! by no link; each is answered at once, because nothing is stored and there is no program.

use super::{Executor, Outcome, Product, admit, confirm};
use crate::can::StandardId;
use crate::device::{Circuit, Device, Inversion, Supervised, Supply};
use crate::param::GlobalParameter as G;
use crate::tmcl::{Command, Opcode, Reply, Status, can};
use crate::units::Micros;
use crate::vm::Machine;

/// Number of bytes of a command, and of a reply.
pub(crate) const LENGTH: usize = Command::SIZE;

/// An executor with the registers that its commands use.
pub(crate) struct Solo {
    executor: Executor<1>,
    /// The interpreter, which has no program memory.
    machine: Machine,
}

/// The outcome of a command.
pub(crate) struct Answered {
    /// The reply, as the data of a CAN frame (manual section 3.1).
    pub(crate) reply: [u8; LENGTH],
    /// The command was executed.
    pub(crate) executed: bool,
}

impl Solo {
    /// An executor of a product that stores nothing and has no program memory.
    #[inline(always)]
    pub(crate) fn new<P: Product>() -> Self {
        const { assert!(P::SPEC.slots.is_none() && P::SPEC.commands == 0, "nobody would store settings or a program") };
        Solo { executor: Executor::new::<P>(0), machine: Machine::new(0) }
    }

    /// Begins at `now` with a device that its owner has started, whose motor stands, and whose signals are inverted so.
    pub(crate) fn begin(&mut self, now: Micros, inversion: Inversion) {
        let Executor { globals, random, .. } = &mut self.executor;
        globals.set(G::EndSwitchPolarity, inversion.switches.into());
        globals.set(G::ReverseShaft, inversion.shafts.into());
        *random = now.0 as u32;
        self.executor.begin_ticks(now);
    }

    /// Takes notice of what the device has supervised: where the motors have been stopped, a program would be, too, and
    /// shows as stopped.
    pub(crate) fn heed(&mut self, supervised: &Supervised) {
        if supervised.silent || supervised.supply == Supply::Lost {
            self.machine.stop();
        }
    }

    /// Executes a command. While it is `barred`, no motor is started: the status is 6 then. `node` comes first in the
    /// reply. What needs a link or a program is refused with status 6, and so is what would restart the firmware: that
    /// is for the owner to decide. Global parameter 255 suppresses no reply.
    pub(crate) fn answer<T: Circuit<Product: Product>>(
        &mut self,
        device: &mut Device<T, 1>,
        now: Micros,
        barred: bool,
        node: u8,
        command: [u8; LENGTH],
    ) -> Answered {
        let command = Command::from_bytes(command);
        let outcome = admit::<T::Product, 1>(command).and_then(|opcode| match opcode {
            Opcode::StopApplication => {
                self.machine.stop();
                Ok(Outcome::Value(command.value))
            }
            Opcode::ResetApplication => {
                self.machine.reset();
                Ok(Outcome::Value(command.value))
            }
            Opcode::ApplicationStatus => {
                self.machine.status(command.kind, 0).map(Outcome::Value).ok_or(Status::WrongType)
            }
            Opcode::RunApplication if command.kind > 1 => Err(Status::WrongType),
            Opcode::FirmwareVersion => T::Product::SPEC.version(command.kind),
            Opcode::FactorySettings => confirm(command.value).and(Err(Status::EepromLocked)),
            _ => self.executor.on(now, barred, &mut self.machine, device).act(opcode, command),
        });
        let reply = outcome.and_then(|outcome| outcome.reply(command).ok_or(Status::NotAvailable));
        let reply = reply.unwrap_or_else(|status| Reply::echo(status, command));
        let executed = !matches!(reply, Reply::Plain { status, .. } if status != Status::Ok);
        let id = StandardId::new(node.into()).unwrap_or(StandardId::ZERO);
        let reply = can::encode_reply(id, LENGTH, &reply).first_chunk().copied().unwrap_or_default();
        Answered { reply, executed }
    }
}
