//! A module inside another firmware: its commands come one by one and by no link, and each is answered at once, because
//! nothing is stored and no program runs. So a CANopen node in TMCL mode executes what its master writes to an object.

use super::origin::Source;
use super::outcome::Outcome;
use super::supervision::Supervision;
use super::{Module, Platform};
use crate::device::{Device, Inversion};
use crate::param::GlobalParameter;
use crate::tmcl::{Command, Opcode, Reply, Status};
use crate::units::Micros;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// The device, which the other firmware uses until the module [takes it over](Self::take_over), and beside the module
    /// after that.
    pub(crate) const fn device(&self) -> &Device<T, AXES> {
        &self.device
    }

    /// The device, to command.
    pub(crate) const fn device_mut(&mut self) -> &mut Device<T, AXES> {
        &mut self.device
    }

    /// In place of a [start](Self::start): takes over a device that the other firmware has started, with its motors where
    /// they are, its axis parameters as they were set, and these signals inverted. That firmware has stopped the motors and
    /// switches the drivers.
    pub(crate) fn take_over(&mut self, now: Micros, inversion: Inversion) {
        self.set_global_value(GlobalParameter::EndSwitchPolarity, inversion.switches.into());
        self.set_global_value(GlobalParameter::ReverseShaft, inversion.shafts.into());
        self.supervision = Supervision::new(now);
        self.tick_offset = now.millis() as u32;
        self.random = now.0 as u32;
    }

    /// Says whether the other firmware lets motors be started; status 6 refuses it.
    pub(crate) const fn bar(&mut self, barred: bool) {
        self.barred = barred;
    }

    /// True while no motor may be started.
    pub(super) fn is_barred(&self) -> bool {
        self.spec().guest && self.barred
    }

    /// Executes a command. What needs a link is refused with status 6, and so is what would restart the firmware: that is
    /// for the other one to decide. Global parameter 255 suppresses no reply.
    pub(crate) fn answer(&mut self, now: Micros, command: Command) -> Reply {
        let outcome = self.admit(Source::Can, command).and_then(|opcode| match opcode {
            Some(Opcode::SoftwareReset | Opcode::EnterBootloader | Opcode::EnterAscii) | None => {
                Err(Status::NotAvailable)
            }
            Some(opcode) => self.act(now, None, opcode, command),
        });
        match outcome {
            Ok(Outcome::Value(value) | Outcome::Read(value) | Outcome::Stored { value, .. }) => {
                Reply::Plain { status: Status::Ok, opcode: command.opcode, value }
            }
            Ok(Outcome::Special(reply)) => reply,
            Ok(Outcome::Unanswered) => Reply::echo(Status::NotAvailable, command),
            Err(status) => Reply::echo(status, command),
        }
    }
}
